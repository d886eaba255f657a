/** The faults of the simulated station, with the names used by the API. */

export interface SimulatedFault {
  name: string;
  device: "camera" | "stage" | "laser";
  /** Its parameter, if any, with the server's default. */
  value?: { unit: string; default_value: number; min: number; max: number };
}

export const FAULTS: readonly SimulatedFault[] = [
  { name: "lost_frames", device: "camera", value: { unit: "", default_value: 10, min: 1, max: 1e9 } },
  { name: "camera_unplugged", device: "camera" },
  { name: "wrong_frame_size", device: "camera" },
  { name: "wrong_pixel_format", device: "camera" },
  { name: "camera_hang", device: "camera" },
  { name: "sensor_defects", device: "camera", value: { unit: "", default_value: 6, min: 0, max: 50 } },
  { name: "conveyor_stopped", device: "stage" },
  { name: "lens_covered", device: "camera" },
  { name: "stage_stall", device: "stage", value: { unit: "mm", default_value: 5, min: -1e4, max: 1e4 } },
  { name: "lost_steps", device: "stage", value: { unit: "mm", default_value: 0.5, min: -1e4, max: 1e4 } },
  { name: "stage_silent", device: "stage" },
  { name: "stage_unplugged", device: "stage" },
  { name: "laser_fault", device: "laser" },
  { name: "interlock_open", device: "laser" },
  { name: "laser_unplugged", device: "laser" },
  {
    name: "wavelength_drift",
    device: "laser",
    value: { unit: "", default_value: 0.001, min: -0.049, max: 0.049 },
  },
  { name: "dirty_grating", device: "laser", value: { unit: "", default_value: 0.3, min: 0, max: 1 } },
];
