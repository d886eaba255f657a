export const tools = {
  plane: "Ebene",
  sphere: "Kugel",
  cylinder: "Zylinder",
  step: "Stufe",
  distance: "Abstand",
  angle: "Winkel",
  flatness: "Ebenheit",
};

export const measured_as: Record<string, string> = {
  plane: "Abstand der Ebene",
  sphere: "Radius der Kugel",
  cylinder: "Radius des Zylinders",
  step: "Höhe der Stufe",
  distance: "Abstand",
  angle: "Winkel",
  flatness: "Ebenheit",
};

export const outcomes = {
  ok: "i. O.",
  undecided: "UNENTSCHIEDEN",
  invalid: "UNGÜLTIG",
  not_ok: "n. i. O.",
  partial: "Unvollständig",
  measured: "Gemessen",
  scanned: "Gescannt",
};

export const light_models: Record<string, string> = {
  grating: "Gittergleichung",
  planes: "eine Ebene je Ordnung",
  pencil: "Ebenenbüschel",
};
