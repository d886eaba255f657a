/** The points in a cut through a cloud, as a profile for the plot. */

import type { OrderRange, ProfileMessage } from "../../stream/protocol";
import { sigmaOfClass } from "../../stream/protocol";
import type { Cloud } from "./cloud";
import type { Vec3 } from "./shapes";
import { AXIS_NAMES, type Axis, type Cut, type DisplayedSpace, isInBox, isInCut } from "./space";

/** Points of an order farther apart than this many mean distances are not connected. */
const CONNECTED = 6;

export interface CutProfile {
  profile: ProfileMessage;
  /** Axes of the plot: to the right and upwards. */
  across: "x" | "y";
  up: "y" | "z";
  /** Positions of the points of the profile, part frame, mm. */
  at: readonly Vec3[];
}

/** The axes that a cut is plotted in: z upwards if possible. */
export function plotAxes(axis: Axis): { across: 0 | 1; up: 1 | 2 } {
  return axis === 0 ? { across: 1, up: 2 } : axis === 1 ? { across: 0, up: 2 } : { across: 0, up: 1 };
}

/** The displayed points in a cut, by order and along the horizontal axis of the plot. */
export function cutProfile(cloud: Cloud, cut: Cut, { crop }: DisplayedSpace): CutProfile {
  const { across, up } = plotAxes(cut.axis);
  const found: { at: Vec3; order: number; sigma_mm: number }[] = [];
  for (const chunk of cloud.chunks) {
    for (let point = 0; point < chunk.n_points; point++) {
      const at = chunk.position(point);
      if (!isInCut(cut, at) || (crop && !isInBox(crop, at))) continue;
      const { order, sigma_class } = chunk.attributes(point);
      found.push({ at, order, sigma_mm: sigmaOfClass(sigma_class) });
    }
  }
  found.sort((a, b) => a.order - b.order || a.at[across] - b.at[across]);
  const orders: OrderRange[] = [];
  found.forEach(({ order }, first) => {
    const last = orders[orders.length - 1];
    if (last?.order === order) last.n_points += 1;
    else orders.push({ order, first, n_points: 1 });
  });
  const column = (axis: Axis) => Float32Array.from(found, ({ at }) => at[axis]);
  const [x_mm, y_mm] = [column(0), column(1)];
  const along = across === 0 ? x_mm : y_mm;
  const step_mm = meanStep(along, orders);
  const least = along.reduce((min, value) => Math.min(min, value), Number.POSITIVE_INFINITY);
  const pixels = new Uint16Array(2 * found.length);
  for (let idx = 0; idx < found.length; idx++)
    pixels.fill(((along[idx] ?? 0) - least) / (CONNECTED * step_mm), 2 * idx, 2 * idx + 2);
  return {
    across: AXIS_NAMES[across] as "x" | "y",
    up: AXIS_NAMES[up] as "y" | "z",
    at: found.map(({ at }) => at),
    profile: {
      kind: "profile",
      number: 0,
      sequence: 0,
      captured_ms: 0,
      position_mm: cut.at_mm,
      laser_on: true,
      calibrated: true,
      along: AXIS_NAMES[across] as "x" | "y",
      n_left_out: 0,
      n_lines: orders.length,
      width_px: pixels.reduce((max, value) => Math.max(max, value), 0),
      height_px: pixels.reduce((max, value) => Math.max(max, value), 0),
      units_per_px: 1,
      orders,
      x_mm,
      y_mm,
      z_mm: column(up),
      sigma_mm: Float32Array.from(found, ({ sigma_mm }) => sigma_mm),
      pixels,
    },
  };
}

/** Mean distance of neighbours of an order along the axis; 1 without neighbours. */
function meanStep(along: Float32Array, orders: readonly OrderRange[]): number {
  let [length, n_steps] = [0, 0];
  for (const { first, n_points } of orders) {
    length += (along[first + n_points - 1] ?? 0) - (along[first] ?? 0);
    n_steps += n_points - 1;
  }
  return n_steps > 0 && length > 0 ? length / n_steps : 1;
}

/** A cut through the middle of a box. */
export function middleCut({ min, max }: { min: Vec3; max: Vec3 }, axis: Axis, before?: Cut): Cut {
  const middle = (min[axis] + max[axis]) / 2;
  const at_mm = Number(middle.toFixed(2));
  return { axis, at_mm, thickness_mm: before?.thickness_mm ?? 0.4, hides: before?.hides ?? false };
}

/** Distance of two points within a cut, and its parts along the axes of the plot, mm. */
export function distanceInCut(axis: Axis, from: Vec3, to: Vec3) {
  const { across, up } = plotAxes(axis);
  const [dx, dy] = [to[across] - from[across], to[up] - from[up]];
  return { distance_mm: Math.hypot(dx, dy), across_mm: dx, up_mm: dy };
}
