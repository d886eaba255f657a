/** How the values of a cloud are distributed: from a sample, so that six million points cost no more than few. */

import { sigmaOfClass } from "../../stream/protocol";
import type { ValueMode, ValueRange } from "../colours";
import type { Cloud } from "./cloud";
import { type Feature, featureDeviation } from "./region";

/** Points looked at. */
const SAMPLE_POINTS = 40_000;

/** Share of points beyond each end of the range that is proposed. */
const TAIL = 0.01;

/** Values of a mode, evenly taken from all points, sorted; unknown ones are left out. */
export function sampleValues(cloud: Cloud, mode: ValueMode, feature: Feature | undefined): Float32Array {
  const every = Math.max(1, Math.ceil(cloud.n_points / SAMPLE_POINTS));
  const values: number[] = [];
  for (const chunk of cloud.chunks) {
    for (let point = 0; point < chunk.n_points; point += every) {
      const value = valueAt(mode, chunk.position(point), chunk.attributes(point), feature);
      if (Number.isFinite(value)) values.push(value);
    }
  }
  return Float32Array.from(values).sort();
}

/** The value behind a point's colour; `NaN` if unknown or if the point is not part of the feature. */
export function valueAt(
  mode: ValueMode,
  at: readonly [number, number, number],
  point: { intensity: number; sigma_class: number },
  feature: Feature | undefined,
): number {
  switch (mode) {
    case "height":
      return at[2];
    case "sigma":
      return 1e3 * sigmaOfClass(point.sigma_class);
    case "intensity":
      return point.intensity;
    case "deviation":
      return feature ? 1e3 * featureDeviation(feature, at) : Number.NaN;
  }
}

/** How many points are shown where those outside of a range are hidden; points without a value stay. */
export function countShown(
  cloud: Cloud,
  mode: ValueMode,
  feature: Feature | undefined,
  range: ValueRange,
): number {
  let n_shown = 0;
  for (const chunk of cloud.chunks) {
    for (let point = 0; point < chunk.n_points; point++) {
      if (!isHidden(valueAt(mode, chunk.position(point), chunk.attributes(point), feature), mode, range))
        n_shown += 1;
    }
  }
  return n_shown;
}

/** Whether a point with this value is hidden with what is outside; of deviations everything but the feature is. */
export function isHidden(value: number, mode: ValueMode, { low, high }: ValueRange): boolean {
  return Number.isNaN(value) ? mode === "deviation" : value < low || value > high;
}

/** A range that shows nearly all values; that of deviations is symmetric. */
export function proposedRange(sorted: Float32Array, mode: ValueMode): ValueRange {
  if (sorted.length === 0) return mode === "deviation" ? { low: -100, high: 100 } : { low: 0, high: 1 };
  if (mode === "deviation") return symmetric(sorted);
  const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))] ?? 0;
  const [low, high] = [at(TAIL), at(1 - TAIL)];
  return high > low ? { low, high } : { low: low - 0.5, high: high + 0.5 };
}

/** Points off the surface (the table around a sphere) would stretch the range: four times the median of |deviation|
 * of the nearer half serves the surface itself. */
function symmetric(sorted: Float32Array): ValueRange {
  const sizes = sorted.map(Math.abs).sort();
  const near = sizes.filter((size) => size < 300);
  const sizes_used = near.length > 0.02 * sizes.length ? near : sizes;
  const middle = sizes_used[Math.floor(sizes_used.length / 2)] ?? 0;
  const reach = Math.max(1, 4 * middle);
  return { low: -reach, high: reach };
}

/** Counts of values in equal bins over the range; what lies outside is left out. */
export function binned(values: Float32Array, { low, high }: ValueRange, n_bins: number): number[] {
  const bins = new Array<number>(n_bins).fill(0);
  const width = (high - low) / n_bins || 1;
  for (const value of values) {
    if (value < low || value > high) continue;
    const bin = Math.min(n_bins - 1, Math.floor((value - low) / width));
    bins[bin] = (bins[bin] ?? 0) + 1;
  }
  return bins;
}
