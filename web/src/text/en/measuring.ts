/** Words of measuring that several pages share. */

export const tools = {
  plane: "Plane",
  sphere: "Sphere",
  cylinder: "Cylinder",
  step: "Step",
  distance: "Distance",
  angle: "Angle",
  flatness: "Flatness",
};

/** What a tool's value is. */
export const measured_as: Record<string, string> = {
  plane: "Distance of the plane",
  sphere: "Radius of the sphere",
  cylinder: "Radius of the cylinder",
  step: "Height of the step",
  distance: "Distance",
  angle: "Angle",
  flatness: "Flatness",
};

export const outcomes = {
  ok: "OK",
  undecided: "UNDECIDED",
  invalid: "INVALID",
  not_ok: "NOT OK",
  partial: "Incomplete",
  measured: "Measured",
  scanned: "Scanned",
};

export const light_models: Record<string, string> = {
  grating: "grating equation",
  planes: "one plane per order",
  pencil: "pencil of planes",
};
