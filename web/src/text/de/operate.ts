export const operate = {
  title: "Bedienen",
  serial: "Seriennummer des Teils",
  serial_placeholder: "eintippen oder scannen; optional",
  start: "Scan starten",
  progress: "Fortschritt",
  home: "Tisch referenzieren",
  obstacles: {
    no_link: "Keine Verbindung zum Server. Sie wird automatisch wiederhergestellt.",
    no_devices: "Ein Gerät ist nicht verbunden.",
    halted: "Die Station wurde gestoppt. Sicherstellen, dass der Bereich frei ist, dann zurücksetzen.",
    fault: "Störung: siehe oben. Ursache beheben, dann quittieren.",
    busy: "Station belegt: Ein Auftrag läuft oder wartet.",
    interlock_open: "Die Verriegelung ist offen. Die Tür der Station schließen.",
    not_calibrated: "Die Station ist nicht kalibriert.",
    not_homed: "Tisch nicht referenziert.",
  },
  remedies: {
    no_devices: "Geräte anzeigen",
    busy: "Aufträge anzeigen",
    not_calibrated: "Kalibrieren",
  } as Record<string, string>,
  last_result: "Letztes Ergebnis",
  no_result:
    "Noch kein Teil gescannt. Ein Teil auf den Tisch legen, die Seriennummer eintippen oder scannen, dann „Scan starten“ drücken.",
  scan_running: "Das Teil wird gescannt und gemessen. Die Bewertung folgt, wenn der Auftrag beendet ist.",
  without_part:
    "Der letzte Scan hat kein Ergebnis: Er endete vor der ersten Zeile, oder sein Ergebnis wurde gelöscht.",
  because: {
    undecided: "Zu nah an der Grenze für eine Entscheidung.",
    invalid:
      "Keine Bewertung möglich: Nicht alles konnte gemessen werden. Das Teil gilt als Ausschuss, bis es erneut gescannt ist.",
    partial:
      "Der Scan wurde vorzeitig gestoppt. Das Teil erneut scannen oder den Scan auf der Seite Scan fortsetzen.",
    scanned: "An diesem Teil wurde nichts gemessen.",
    measured: "Ohne Toleranz gibt es keine Bewertung.",
  } as Record<string, string>,
  uncertainty_hint:
    "Erweiterte Messunsicherheit: Der wahre Wert liegt mit etwa 95 % Wahrscheinlichkeit innerhalb ± U",
  bar: (lower: string, value: string, upper: string) =>
    `untere Grenze ${lower}, Wert ${value}, obere Grenze ${upper}`,
  open: "Ergebnis öffnen",
  last_parts: "Letzte 20 Teile",
  no_parts: "Jedes gescannte Teil erscheint hier.",
  rejected_of: (failed: number, all: number) =>
    failed === 0 ? `${all}, kein Ausschuss` : `${failed} von ${all} Ausschuss`,
  set_up: "Scan- und Messeinstellungen",
  from: "Von",
  to: "Bis",
  step: "Schritt",
  exposure: "Belichtung",
  automatic: "automatisch",
  tool: "Messen",
  add_measurement: "Messung hinzufügen",
  remove_measurement: "Entfernen",
  characteristic_name: "Name",
  no_tool: "nichts (nur scannen)",
  nominal: "Sollwert",
  tolerance: "Toleranz ±",
  range: (from: string, to: string, step: string, unit: string) =>
    `${from} … ${to}${unit} in Schritten von ${step}${unit}`,
  no_verdict_without_nominal: "Ohne Sollwert gibt es keine Bewertung.",
  stored_on_server: "Auf dem Server gespeichert, für alle Teile und alle Browser.",
};
