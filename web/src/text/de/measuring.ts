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
  plane: "Ebenenabstand",
  sphere: "Kugelradius",
  cylinder: "Zylinderradius",
  step: "Stufenhöhe",
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

/** Scenes on the simulated stage. */
export const scenes: Record<string, string> = {
  sphere: "Kugel (Radius 18,9 mm)",
  gauge: "Stufenendmaß",
  freeform: "Freiformfläche",
  plate: "Leere Platte",
  board: "Kalibriertafel",
  part: "Teil aus einer STL-Datei",
};

export const scene_on_stage = "Teil auf dem simulierten Tisch";

/** Why a frame was lost. */
export const drop_reasons: Record<string, string> = {
  camera: "an der Kamera verloren",
  incomplete: "Pakete fehlen",
  malformed: "bei der Übertragung beschädigt",
  no_buffer: "kein Puffer frei",
  recorder: "Aufzeichnung zu langsam",
};
