import type { Catalogue } from "../en";

export const damaged: Catalogue["damaged"] = {
  title: (n) =>
    n === 1
      ? "Ein Datensatz ist beschädigt und kann nicht angezeigt werden"
      : `${n} Datensätze sind beschädigt und können nicht angezeigt werden`,
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
  hint: "Die gespeicherten Daten entsprechen nicht dem, was geschrieben wurde: Der Datenträger könnte defekt sein. Alle anderen Datensätze wurden geprüft und sind intakt.",
  remedy: "den Datenordner aus einer Sicherung wiederherstellen und den Datenträger prüfen",
  remedy_delete:
    "löschen, falls sich das Ergebnis neu erzeugen lässt, oder den Datenordner aus einer Sicherung wiederherstellen; den Datenträger prüfen",
  delete_named: (id) => `${id} löschen`,
  delete_question: (id) =>
    `Das beschädigte Ergebnis ${id} mit Punkten und Messungen löschen? Das lässt sich nicht rückgängig machen. Eine Sicherung enthält es möglicherweise noch.`,
};
