/** Finds the point of a frame selected by pointer or keys. */

import type { ImageMessage, ProfileMessage } from "../../stream/protocol";

/** A point of a centreline, px of the frame. */
export interface LinePoint {
  order: number;
  u_px: number;
  v_px: number;
}

/** The nearest point of a visible line within `radius_px` of a position of the frame. */
export function nearestLinePoint(
  image: ImageMessage,
  at: { u_px: number; v_px: number },
  radius_px: number,
  hidden: ReadonlySet<number>,
): LinePoint | undefined {
  const { points, units_per_px } = image;
  const [u, v] = [at.u_px * units_per_px, at.v_px * units_per_px];
  let [best, best_order, best_square] = [-1, 0, (radius_px * units_per_px) ** 2];
  for (const line of image.lines) {
    if (hidden.has(line.order)) continue;
    for (let idx = line.first; idx < line.first + line.n_points; idx++) {
      const square = ((points[2 * idx] ?? 0) - u) ** 2 + ((points[2 * idx + 1] ?? 0) - v) ** 2;
      if (square <= best_square) [best, best_order, best_square] = [idx, line.order, square];
    }
  }
  if (best < 0) return undefined;
  return {
    order: best_order,
    u_px: (points[2 * best] ?? 0) / units_per_px,
    v_px: (points[2 * best + 1] ?? 0) / units_per_px,
  };
}

/** Index of the profile point of a line point; `undefined` if there is none. */
export function profilePointAt(profile: ProfileMessage, at: LinePoint): number | undefined {
  const range = profile.orders.find((row) => row.order === at.order);
  if (!range) return undefined;
  // Both messages use the same units; half a unit allows for rounding of the division only.
  const [u, v] = [at.u_px * profile.units_per_px, at.v_px * profile.units_per_px];
  for (let idx = range.first; idx < range.first + range.n_points; idx++) {
    const [du, dv] = [(profile.pixels[2 * idx] ?? 0) - u, (profile.pixels[2 * idx + 1] ?? 0) - v];
    if (Math.abs(du) < 0.5 && Math.abs(dv) < 0.5) return idx;
  }
  return undefined;
}

/** The order of a profile point. */
export function orderOfPoint(profile: ProfileMessage, idx: number): number | undefined {
  return profile.orders.find((row) => idx >= row.first && idx < row.first + row.n_points)?.order;
}

/** Index of the visible profile point nearest on the screen, within `radius`. */
export function nearestProfilePoint(
  profile: ProfileMessage,
  distanceSquared: (along_mm: number, z_mm: number) => number,
  radius: number,
  hidden: ReadonlySet<number>,
): number | undefined {
  const along = profile.along === "x" ? profile.x_mm : profile.y_mm;
  let [best, best_square] = [-1, radius ** 2];
  for (const range of profile.orders) {
    if (hidden.has(range.order)) continue;
    for (let idx = range.first; idx < range.first + range.n_points; idx++) {
      const square = distanceSquared(along[idx] ?? Number.NaN, profile.z_mm[idx] ?? Number.NaN);
      if (square <= best_square) [best, best_square] = [idx, square];
    }
  }
  return best < 0 ? undefined : best;
}

/** The next point along the same order; stops at the ends. */
export function neighbour(profile: ProfileMessage, idx: number, step: number): number {
  const range = profile.orders.find((row) => idx >= row.first && idx < row.first + row.n_points);
  if (!range) return idx;
  return Math.min(range.first + range.n_points - 1, Math.max(range.first, idx + step));
}

/** The point of the next (`step` 1) or previous (−1) visible order at about the same position along the line. */
export function acrossOrders(
  profile: ProfileMessage,
  idx: number,
  step: 1 | -1,
  hidden: ReadonlySet<number>,
): number {
  const shown = profile.orders.filter((row) => !hidden.has(row.order) && row.n_points > 0);
  const now = shown.findIndex((row) => idx >= row.first && idx < row.first + row.n_points);
  const range = shown[now + step];
  if (!range) return idx;
  const along = profile.along === "x" ? profile.x_mm : profile.y_mm;
  const wanted = along[idx] ?? 0;
  let best = range.first;
  for (let other = range.first; other < range.first + range.n_points; other++) {
    if (Math.abs((along[other] ?? 0) - wanted) < Math.abs((along[best] ?? 0) - wanted)) best = other;
  }
  return best;
}
