type Step = readonly ["calibration" | "live" | "scan" | "operate" | "results" | "health", string];

export const help = {
  title: "Hilfe",
  contents: "Inhalt",
  first: "Erste Schritte",
  first_steps: [
    ["calibration", "Jetzt kalibrieren drücken, warten, die Kalibrierung aktivieren. Ohne sie misst nichts."],
    ["live", "Kamerabild und Linien ansehen; so belichten, dass die Linien hell sind, aber nicht übersteuert."],
    ["operate", "Teil auf die Achse legen, Seriennummer tippen oder scannen, Start drücken."],
    ["scan", "Bereich und Schritt selbst einstellen und zusehen, wie die Punkte wachsen."],
    ["results", "ein Ergebnis öffnen, Teile über die Zeit vergleichen, Punkte herunterladen."],
    ["health", "wenn etwas nicht stimmt: Was nicht grau ist, will Aufmerksamkeit."],
  ] as readonly Step[],
  simulated:
    "Ein blauer Rahmen und das Wort Simulation bedeuten: Nichts hier ist echt, die Station rechnet ihre Bilder selbst. Alles andere geht genauso.",
  states: "Was die Zustände bedeuten",
  state: "Zustand",
  means: "Bedeutung",
  state_means: {
    Preoperational: "Der Dienst startet, oder ein Gerät fehlt. Welches, sagt die Seite Zustand.",
    "Operational.Initialized":
      "Die Geräte antworten, aber keine Kalibrierung ist aktiv oder die Achse nicht referenziert.",
    "Operational.Ready": "Ein Scan kann beginnen.",
    "Operational.SingleExecution":
      "Ein Auftrag hat die Station. Befehle von Hand werden bis zu seinem Ende abgelehnt.",
    "Operational.ContinuousExecution": "Die Kamera läuft für das Live-Bild. Ein Auftrag darf jederzeit beginnen.",
    Halted: "Jemand hat Stopp gedrückt. Bewegung und Laser bleiben bis zum Zurücksetzen aus.",
    Error: "Ein Gerät ist ausgefallen. Die Ursache beheben, dann quittieren und zurücksetzen.",
  } as Record<string, string>,
  verdicts: "Was die Urteile bedeuten",
  verdict_means: {
    ok: "Der Wert liegt um mehr als seine Unsicherheit U innerhalb der Toleranz (ISO 14253-1).",
    not_ok: "Der Wert liegt um mehr als U außerhalb der Toleranz.",
    undecided: "Eine Grenze liegt innerhalb ± U um den Wert: zu nah, um zu entscheiden.",
    invalid: "Etwas war nicht messbar, oder beim Scan gingen Bilder verloren: Ausschuss. Noch einmal scannen.",
    measured: "Es gibt einen Wert, aber keine Toleranz, an der er zu messen wäre.",
  } as Record<string, string>,
  stop: "Laser und Stopp",
  stop_says: [
    "Stopp wirkt von jeder Seite, für jeden, mit oder ohne Bedienung, und fragt nie nach. Tasten: Strg + . oder Pause.",
    "Stopp hält die Achse an und schaltet den Laser aus; beide bleiben bis zum Zurücksetzen aus. Ein laufender Scan bleibt, so weit er kam, und lässt sich fortsetzen.",
    "Nach Stopp bewegt sich und leuchtet nichts von selbst. Ein Mensch setzt die Station zurück.",
    "Der Laser leuchtet nur in einem Auftrag oder im Live-Bild. Er geht aus, wenn Bilder ausbleiben, wenn der Dienst endet und bei jeder Störung.",
    "Stopp ist kein Not-Halt: Er braucht diese Seite, das Netz und den Server. Bei Gefahr den Not-Halt der Maschine benutzen.",
    "Nur eine Seite bedient auf einmal. Aufträge brauchen keine Bedienung; Befehle von Hand nehmen sie, und jeder darf sie übernehmen.",
  ],
  shortcuts: "Tastenkürzel",
  keys: "Tasten",
  does: "Wirkung",
  shortcut_keys: [
    ["Strg + .", "Stopp"],
    ["Pause", "Stopp"],
    ["?", "Diese Tastenkürzel"],
    ["Tab", "Nächstes Bedienelement; Umschalt + Tab zurück"],
    ["Enter", "Drückt einen Knopf; in der Seriennummer: startet den Scan"],
    ["Esc", "Schließt ein Fenster"],
  ] as readonly (readonly [string, string])[],
  letters_off:
    "Auf Bedienen gehen Buchstaben in die Seriennummer, damit ein Scanner immer trifft. Buchstaben als Kürzel sind abschaltbar:",
  programs: "Für Programme",
  programs_say: "Alles, was diese Seite tut, geht über die öffentliche Schnittstelle.",
  explorer: "Schnittstelle erkunden",
  openapi: "die Schnittstelle als OpenAPI-Dokument",
  first_job: "zeigt die Zeile für einen ersten Auftrag, solange es keinen gibt",
  about: "Über",
  libraries: "Diese Seite enthält diese Bibliotheken, alle unter der MIT-Lizenz:",
  licence_text: "MIT-Lizenz",
};
