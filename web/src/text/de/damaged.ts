import type { Catalogue } from "../en";

export const damaged: Catalogue["damaged"] = {
  title: (n) =>
    n === 1
      ? "Ein Eintrag ist beschädigt und lässt sich nicht zeigen"
      : `${n} Einträge sind beschädigt und lassen sich nicht zeigen`,
  kinds: {
    job: "Auftrag",
    capture: "Aufnahme",
    calibration: "Kalibrierung",
    activation: "Aktivierung",
    scan: "Ergebnis",
    measurement: "Messung",
    session: "Kalibriersitzung",
    event: "Ereignis",
  },
  hint: "Es steht nicht mehr da, was geschrieben wurde: Der Datenträger könnte defekt sein. Alle anderen Einträge sind geprüft und heil.",
  remedy: "den Datenordner aus einer Sicherung wiederherstellen und den Datenträger prüfen",
  remedy_delete:
    "löschen, wenn es sich neu gewinnen lässt, oder den Datenordner aus einer Sicherung wiederherstellen; den Datenträger prüfen",
  delete_named: (id) => `${id} löschen`,
  delete_question: (id) =>
    `Das beschädigte Ergebnis ${id} mit seinen Punkten und Messungen löschen? Das ist endgültig. Eine Sicherung hat es vielleicht noch heil.`,
};
