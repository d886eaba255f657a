/** Texts about measurements that several pages share. */

export const tools = {
  plane: "Plane",
  sphere: "Sphere",
  cylinder: "Cylinder",
  step: "Step",
  distance: "Distance",
  angle: "Angle",
  flatness: "Flatness",
};

/** The quantity that a tool measures. */
export const measured_as: Record<string, string> = {
  plane: "Plane distance",
  sphere: "Sphere radius",
  cylinder: "Cylinder radius",
  step: "Step height",
  distance: "Distance",
  angle: "Angle",
  flatness: "Flatness",
};

export const outcomes = {
  ok: "OK",
  undecided: "UNDECIDED",
  invalid: "INVALID",
  not_ok: "NOT OK",
  partial: "Partial",
  measured: "Measured",
  scanned: "Scanned",
};

export const light_models: Record<string, string> = {
  grating: "grating equation",
  planes: "one plane per order",
  pencil: "pencil of planes",
};

/** Scenes on the simulated stage. */
export const scenes: Record<string, string> = {
  sphere: "Sphere (radius 18.9 mm)",
  gauge: "Step gauge",
  freeform: "Freeform surface",
  plate: "Empty plate",
  board: "Calibration board",
  part: "Part from an STL file",
};

export const scene_on_stage = "Part on the simulated stage";

/** Why a frame was lost. */
export const drop_reasons: Record<string, string> = {
  camera: "lost at the camera",
  incomplete: "packets missing",
  malformed: "damaged in transfer",
  no_buffer: "no free buffer",
  recorder: "recorder too slow",
};
