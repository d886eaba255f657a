/** The displayed part of space: a crop box and a cut plane, in the part frame. */

import type { Box, Cloud } from "./cloud";
import type { Vec3 } from "./shapes";

export const AXES = [0, 1, 2] as const;
export type Axis = (typeof AXES)[number];
export const AXIS_NAMES = ["x", "y", "z"] as const;

/** A slab perpendicular to an axis. */
export interface Cut {
  axis: Axis;
  at_mm: number;
  thickness_mm: number;
  /** Whether points beyond it (with larger coordinates) are hidden. */
  hides: boolean;
}

export interface DisplayedSpace {
  /** Only points in this box are displayed; undefined: all. */
  crop: Box | undefined;
  cut: Cut | undefined;
}

export const WHOLE_SPACE: DisplayedSpace = { crop: undefined, cut: undefined };

export function isInBox({ min, max }: Box, at: Vec3): boolean {
  return AXES.every((axis) => at[axis] >= min[axis] && at[axis] <= max[axis]);
}

export function isInCut({ axis, at_mm, thickness_mm }: Cut, at: Vec3): boolean {
  return Math.abs(at[axis] - at_mm) <= thickness_mm / 2;
}

/** Whether a point is displayed. */
export function isDisplayed({ crop, cut }: DisplayedSpace, at: Vec3): boolean {
  if (crop && !isInBox(crop, at)) return false;
  return !cut?.hides || at[cut.axis] <= cut.at_mm + cut.thickness_mm / 2;
}

/** Calls `found` for every point of a cloud. */
export function eachPoint(cloud: Cloud, found: (at: Vec3) => void): void {
  for (const chunk of cloud.chunks) {
    for (let point = 0; point < chunk.n_points; point++) found(chunk.position(point));
  }
}

/** Number of points in a box. */
export function countIn(cloud: Cloud, box: Box): number {
  let n_points = 0;
  eachPoint(cloud, (at) => {
    if (isInBox(box, at)) n_points += 1;
  });
  return n_points;
}
