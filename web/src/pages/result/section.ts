/** Converts one frame of a stored scan to a profile for the plot. */

import type { Schemas } from "../../api/client";
import type { OrderRange, ProfileMessage } from "../../stream/protocol";

type Profile = Schemas["ProfileDto"];

/** Difference between the largest and the smallest number. */
function extent(numbers: readonly number[]): number {
  let [least, most] = [Infinity, -Infinity];
  for (const number of numbers) {
    if (number < least) least = number;
    if (number > most) most = number;
  }
  return Math.max(0, most - least);
}

/** Sorts the points by order and along their lines, which run along the axis in which they are longer. */
export function sectionOf(profile: Profile): ProfileMessage {
  const along = extent(profile.u_px) >= extent(profile.v_px) ? "x" : "y";
  const seen = along === "x" ? profile.u_px : profile.v_px;
  const order = (idx: number) => profile.order[idx] ?? 0;
  const sorted = profile.order
    .map((_, idx) => idx)
    .sort((a, b) => order(a) - order(b) || (seen[a] ?? 0) - (seen[b] ?? 0));
  const column = (numbers: readonly number[]) => Float32Array.from(sorted, (idx) => numbers[idx] ?? Number.NaN);
  const orders: OrderRange[] = [];
  sorted.forEach((idx, place) => {
    const last = orders[orders.length - 1];
    if (last?.order === order(idx)) last.n_points += 1;
    else orders.push({ order: order(idx), first: place, n_points: 1 });
  });
  return {
    kind: "profile",
    number: profile.sequence,
    sequence: profile.sequence,
    captured_ms: (profile.captured_at_ns ?? 0) / 1e6,
    position_mm: profile.position_mm ?? profile.angle_deg ?? Number.NaN,
    laser_on: true,
    calibrated: true,
    along,
    n_left_out: 0,
    n_lines: orders.length,
    width_px: extent(profile.u_px),
    height_px: extent(profile.v_px),
    units_per_px: 1,
    orders,
    x_mm: column(profile.x_mm),
    y_mm: column(profile.y_mm),
    z_mm: column(profile.z_mm),
    sigma_mm: column(profile.sigma_mm),
    pixels: Uint16Array.from(
      sorted.flatMap((idx) => [Math.round(profile.u_px[idx] ?? 0), Math.round(profile.v_px[idx] ?? 0)]),
    ),
  };
}
