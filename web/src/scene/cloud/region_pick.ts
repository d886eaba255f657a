/** The region selected by a rectangle of the view: the box around the displayed points inside it. */

import type { Box, Cloud } from "./cloud";
import { type Projection, project } from "./picking";
import type { Vec3 } from "./shapes";
import { AXES, eachPoint } from "./space";

/** A rectangle of the view, CSS pixels from the top-left corner. */
export interface Rectangle {
  left_px: number;
  top_px: number;
  right_px: number;
  bottom_px: number;
}

export interface ViewSize {
  width_px: number;
  height_px: number;
}

/** Corners are rounded outwards to this, mm, so that no selected point is lost by rounding. */
const ROUNDED_MM = 0.01;

/** The box around the points of a rectangle that are `displayed`; undefined if there are none. */
export function regionIn(
  cloud: Cloud,
  clip: Projection,
  { left_px, top_px, right_px, bottom_px }: Rectangle,
  { width_px, height_px }: ViewSize,
  displayed: (at: Vec3) => boolean,
): Box | undefined {
  const min: [number, number, number] = [Infinity, Infinity, Infinity];
  const max: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  eachPoint(cloud, (at) => {
    const [x, y, depth] = project(clip, at, width_px, height_px);
    if (x < left_px || x > right_px || y < top_px || y > bottom_px || Math.abs(depth) > 1) return;
    if (!displayed(at)) return;
    for (const axis of AXES) {
      min[axis] = Math.min(min[axis], at[axis]);
      max[axis] = Math.max(max[axis], at[axis]);
    }
  });
  return min[0] > max[0] ? undefined : outwards({ min, max });
}

function outwards({ min, max }: Box): Box {
  const rounded = (value: number, round: (value: number) => number) =>
    Number((round(value / ROUNDED_MM) * ROUNDED_MM).toFixed(2));
  const all = (corner: Box["min"], round: (value: number) => number): Box["min"] => [
    rounded(corner[0], round),
    rounded(corner[1], round),
    rounded(corner[2], round),
  ];
  return { min: all(min, Math.floor), max: all(max, Math.ceil) };
}
