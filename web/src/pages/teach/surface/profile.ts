/** The surface profile of a part: what is entered for it, and the characteristic that it becomes. */

import type { Schemas } from "../../../api/client";
import type { Box } from "../../../scene/cloud/cloud";
import type { Characteristic } from "../draft";

export type Model = Schemas["ModelDto"];

/** x, y, z (mm) and rotations about x, y, z (degrees): approximate pose of the model in the scan. */
export type StartPose = readonly [number, number, number, number, number, number];

export const NO_POSE: StartPose = [0, 0, 0, 0, 0, 0];

/** Names of the entries of a pose. */
export const POSE_ENTRIES = [
  { axis: "x", unit: "mm" },
  { axis: "y", unit: "mm" },
  { axis: "z", unit: "mm" },
  { axis: "x", unit: "°" },
  { axis: "y", unit: "°" },
  { axis: "z", unit: "°" },
] as const;

/** What is entered for a surface profile. */
export interface SurfaceEntries {
  model: Pick<Model, "name" | "sha256">;
  /** Of all points, after the alignment of the plan. */
  best_fit: boolean;
  start: StartPose;
  /** The box of the model that is toleranced; the whole surface if undefined. */
  region: Box | undefined;
  /** Points farther from the model do not belong to it. */
  reach_mm: number | undefined;
  /** The width of the tolerance zone. */
  width_mm: number | undefined;
}

/** The characteristic. A plan without an alignment aligns the model by best fit, from the start pose. */
export function surfaceProfile(id: string, entries: SurfaceEntries, is_aligned: boolean): Characteristic {
  const { model, region } = entries;
  const { name, sha256 } = model;
  const fit = is_aligned ? entries.best_fit && { best_fit: true } : { best_fit: true, start: [...entries.start] };
  return {
    id,
    measure: {
      type: "surface_profile",
      model: { name, sha256 },
      ...fit,
      ...(region && { region: { type: "box", min_mm: [...region.min], max_mm: [...region.max] } }),
      ...(entries.reach_mm !== undefined && { reach_mm: entries.reach_mm }),
    },
    ...(entries.width_mm !== undefined && { upper: entries.width_mm }),
  };
}

/**
 * A pose in a box of the scan: z of the model towards the camera, which looks along z of the scan, the middle of the
 * model in that of the box, and its top at the point nearest to the camera.
 */
export function proposedPose(
  { min_mm, max_mm }: Pick<Model["summary"], "min_mm" | "max_mm">,
  box: Box,
): StartPose {
  const middle = (low = 0, high = 0) => (low + high) / 2;
  // Half a turn about y reverses x and z.
  const x = middle(box.min[0], box.max[0]) + middle(min_mm[0], max_mm[0]);
  const y = middle(box.min[1], box.max[1]) - middle(min_mm[1], max_mm[1]);
  const z = box.min[2] + (max_mm[2] ?? 0);
  return [rounded(x), rounded(y), rounded(z), 0, 180, 0];
}

/** To 0.1 mm: the best fit does the rest. */
function rounded(value_mm: number): number {
  return Number(value_mm.toFixed(1));
}

/** A pose with another value of one entry. */
export function withEntry(pose: StartPose, idx: number, value: number): StartPose {
  const [x, y, z, rx, ry, rz] = pose.map((one, at) => (at === idx ? value : one));
  return [x ?? 0, y ?? 0, z ?? 0, rx ?? 0, ry ?? 0, rz ?? 0];
}

/** The box around the whole model, to 0.1 mm. */
export function boundsOf({ min_mm, max_mm }: Pick<Model["summary"], "min_mm" | "max_mm">): Box {
  const corner = ([x = 0, y = 0, z = 0]: readonly number[], round: (tenths: number) => number): Box["min"] => {
    const outward = (value_mm: number) => round(10 * value_mm) / 10;
    return [outward(x), outward(y), outward(z)];
  };
  return { min: corner(min_mm, Math.floor), max: corner(max_mm, Math.ceil) };
}

/** A box with another coordinate of one corner. */
export function withCoordinate(box: Box, end: keyof Box, axis: number, value: number): Box {
  const [x, y, z] = box[end].map((one, at) => (at === axis ? value : one));
  return { ...box, [end]: [x ?? 0, y ?? 0, z ?? 0] };
}

/** Whether the box has a volume. */
export function hasVolume({ min, max }: Box): boolean {
  return min.every((low, axis) => low < (max[axis] ?? low));
}
