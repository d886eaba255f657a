type Step = readonly ["calibration" | "live" | "scan" | "operate" | "results" | "health", string];

export const help = {
  title: "Hilfe",
  contents: "Inhalt",
  first: "Erste Schritte",
  first_steps: [
    [
      "calibration",
      "„Jetzt kalibrieren“ drücken, das Ende abwarten, dann die Kalibrierung aktivieren. Ohne sie ist keine Messung möglich.",
    ],
    [
      "live",
      "Kamerabild und Linien prüfen; die Belichtung so einstellen, dass die Linien hell, aber nicht übersteuert sind.",
    ],
    [
      "operate",
      "das Teil auf den Tisch legen, die Seriennummer eintippen oder scannen, dann „Scan starten“ drücken.",
    ],
    ["scan", "Bereich und Schritt selbst einstellen und die wachsende Punktwolke verfolgen."],
    ["results", "ein Ergebnis öffnen, Teile über die Zeit vergleichen, Punkte herunterladen."],
    ["health", "wenn etwas nicht stimmt: Alles, was nicht grau ist, erfordert Aufmerksamkeit."],
  ] as readonly Step[],
  simulated:
    "Ein blauer Rahmen und das Wort Simulation bedeuten simulierte Daten: Die Station berechnet die Bilder, statt sie aufzunehmen. Alles andere funktioniert wie an einer echten Station.",
  states: "Was die Zustände bedeuten",
  state: "Zustand",
  means: "Bedeutung",
  state_means: {
    Preoperational: "Der Dienst startet, oder ein Gerät fehlt; welches, zeigt Diagnose.",
    "Operational.Initialized":
      "Die Geräte antworten, aber es ist keine Kalibrierung aktiv oder der Tisch nicht referenziert.",
    "Operational.Ready": "Ein Scan kann beginnen.",
    "Operational.SingleExecution":
      "Ein Auftrag belegt die Station. Handbefehle werden bis zu seinem Ende abgelehnt.",
    "Operational.ContinuousExecution": "Die Kamera läuft für das Live-Bild. Ein Auftrag kann jederzeit beginnen.",
    Halted: "Jemand hat Stopp gedrückt. Bewegung und Laser bleiben bis zum Zurücksetzen aus.",
    Error: "Ein Gerät ist ausgefallen. Die Ursache beheben, dann quittieren und zurücksetzen.",
  } as Record<string, string>,
  verdicts: "Was die Bewertungen bedeuten",
  verdict_means: {
    ok: "Der Wert liegt um mehr als seine Unsicherheit U innerhalb der Toleranz (ISO 14253-1).",
    not_ok: "Der Wert liegt um mehr als U außerhalb der Toleranz.",
    undecided: "Eine Toleranzgrenze liegt innerhalb ± U um den Wert: zu nah an der Grenze für eine Entscheidung.",
    invalid:
      "Keine Bewertung möglich: Etwas konnte nicht gemessen werden, oder beim Scan gingen Bilder verloren. Das Teil als Ausschuss behandeln und erneut scannen.",
    measured: "Es gibt einen Wert, aber keine Toleranz und daher keine Bewertung.",
  },
  stop: "Laser und Stopp",
  stop_rules: [
    "Stopp wirkt auf jeder Seite, für jeden, mit oder ohne Bedienhoheit, und fragt nie nach. Tasten: Strg + . oder Pause.",
    "Stopp hält den Tisch an und schaltet den Laser aus; beide bleiben bis zum Zurücksetzen aus. Ein laufender Scan behält die bisher aufgenommenen Zeilen und lässt sich fortsetzen.",
    "Nach Stopp läuft nichts automatisch wieder an: Eine Person muss die Station zurücksetzen.",
    "Der Laser ist nur während eines Auftrags oder des Live-Bilds an. Er geht aus, wenn Bilder ausbleiben, wenn der Dienst endet und bei jeder Störung.",
    "Wo beim Laser „hier nicht gesteuert“ steht, ist er an, solange er mit Strom versorgt wird; nichts davon schaltet ihn aus.",
    "Stopp ist kein Not-Halt: Er hängt von dieser Seite, dem Netzwerk und dem Server ab. Bei Gefahr den Not-Halt der Maschine betätigen.",
    "Nur eine Seite hat die Bedienhoheit. Aufträge brauchen sie nicht; Handbefehle übernehmen sie, und jeder kann sie von anderen übernehmen.",
  ],
  shortcuts: "Tastenkürzel",
  keys: "Tasten",
  does: "Funktion",
  shortcut_keys: [
    ["Strg + .", "Stopp"],
    ["Pause", "Stopp"],
    ["?", "Diese Tastenkürzel"],
    ["Tab", "Nächstes Element; Umschalt + Tab zurück"],
    ["Enter", "Betätigt eine Schaltfläche; im Feld Seriennummer: startet den Scan"],
    ["Esc", "Schließt einen Dialog"],
  ] as readonly (readonly [string, string])[],
  letters_hint:
    "Auf der Seite Bedienen gehen Buchstaben immer in die Seriennummer, damit ein Barcodescanner jederzeit funktioniert. Kürzel aus einzelnen Buchstaben sind abschaltbar:",
  api: "API",
  api_hint: "Alles, was diese Seite tut, läuft über die öffentliche API.",
  openapi: "die API als OpenAPI-Dokument",
  first_job: "zeigt den Befehl für einen ersten Auftrag, solange es keine Aufträge gibt",
  about: "Über",
  libraries: "Diese Seite enthält diese Bibliotheken, alle unter der MIT-Lizenz:",
  licence_text: "MIT-Lizenz",
};
