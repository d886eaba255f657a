import type { Catalogue } from "../en";

export const recipe_settings: Catalogue["recipe_settings"] = {
  card: "Einstellungen des Rezepts",
  hint: "Sie sind Teil der Version, die als nächste veröffentlicht wird. Ausgangspunkt ist die gewählte Grundlage; ein neues Rezept scannt wie dieser Scan.",
  selection: "Auswahl",
  number: "Rezeptnummer",
  serial_pattern: "Seriennummern (regulärer Ausdruck)",
  selection_hint:
    "Eine SPS wählt das Rezept über seine Nummer. Ist bei einer Prüfung kein Rezept angegeben, wird es für Teile gewählt, deren ganze Seriennummer dem regulären Ausdruck entspricht.",
  scan: "Scan",
  scan_hint: "Die Grenzen der Station werden geprüft, wenn eine Prüfung angefordert wird.",
  stage: "Tisch",
  stages: { linear: "Lineartisch", rotary: "Drehteller" },
  exposure: (number) => `Belichtung ${number}`,
  outputs: "Schnittstellen für die Ergebnisse",
  every_door: "Alle Schnittstellen, die Prüfungen übertragen",
  outputs_hint:
    "Eine SPS, die Prüfungen startet, erhält deren Ergebnisse nur, wenn ihre Schnittstelle ausgewählt ist.",
  no_doors: "An dieser Station ist keine Schnittstelle eingerichtet.",
  no_output: "Keine Schnittstelle erhält die Ergebnisse.",
  unknown_door: "ist an dieser Station nicht eingerichtet: Prüfungen werden abgelehnt.",
  attributes: "Attribute",
  attributes_hint:
    "Werden unverändert mit den Ergebnissen übertragen; gleichnamige Attribute des Teils haben Vorrang.",
  attribute_name: "Name",
  attribute_value: "Wert",
  name_of: (number) => `Name von Attribut ${number}`,
  value_of: (number) => `Wert von Attribut ${number}`,
  add_attribute: "Attribut hinzufügen",
  remove_attribute: (name) => `Attribut ${name} entfernen`,
  attributes_full: (most) => `Es sind höchstens ${most} Attribute möglich.`,
  faults: {
    broken_pattern: "Die Angabe zu den Seriennummern ist kein gültiger regulärer Ausdruck.",
    attribute_unnamed: "Das Attribut braucht einen Namen.",
    attribute_twice: "Zwei Attribute haben denselben Namen.",
    no_range: "Anfang und Ende des Scans angeben.",
    no_step: "Den Schritt des Scans angeben.",
    no_pace: "Ein kontinuierlicher Scan braucht eine Geschwindigkeit oder einen Schritt.",
    no_travel: "Anfang und Ende eines kontinuierlichen Scans müssen verschieden sein.",
    exposure_missing: "Alle Belichtungen einer Zeile angeben.",
    exposures_continuous: "Mehrere Belichtungen je Zeile sind nur bei schrittweiser Bewegung möglich.",
    exposures_ambient: "Mit mehreren Belichtungen je Zeile kann kein Umgebungslicht abgezogen werden.",
    exposures_images:
      "Bilder mit mehreren Belichtungen je Zeile können weder gespeichert noch aufgezeichnet werden.",
    exposures_similar: "Jede Belichtung einer Zeile muss mindestens das 1,5-Fache der nächstkürzeren sein.",
  },
};
