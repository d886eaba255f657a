/** The distribution of a cloud's values, from a sample of limited size. */

import { sigmaOfClass } from "../../stream/protocol";
import type { ValueMode, ValueRange } from "../colours";
import type { Cloud } from "./cloud";
import { type Feature, featureDeviation } from "./region";

/** Maximum size of the sample. */
const SAMPLE_POINTS = 40_000;

/** Share of points outside each end of the automatic range. */
const TAIL = 0.01;

/** Values of a mode for an even sample of the points, sorted, without unknown ones. */
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

/** The value shown as a point's colour; `NaN` if unknown or if the point is not part of the feature. */
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

/** Number of visible points if those outside a range are hidden; points without a value stay visible. */
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

/**
 * Whether a point with this value is hidden with `hide_outside`; for deviations, points outside the feature are
 * hidden too.
 */
export function isHidden(value: number, mode: ValueMode, { low, high }: ValueRange): boolean {
  return Number.isNaN(value) ? mode === "deviation" : value < low || value > high;
}

/** The automatic range, which contains nearly all values; symmetric for deviations. */
export function proposedRange(sorted: Float32Array, mode: ValueMode): ValueRange {
  if (sorted.length === 0) return mode === "deviation" ? { low: -100, high: 100 } : { low: 0, high: 1 };
  if (mode === "deviation") return symmetric(sorted);
  const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))] ?? 0;
  const [low, high] = [at(TAIL), at(1 - TAIL)];
  return high > low ? { low, high } : { low: low - 0.5, high: high + 0.5 };
}

/**
 * A symmetric range: four times the median of |deviation|. Points far from the surface, such as the table around a
 * sphere, are excluded, because they would widen it.
 */
function symmetric(sorted: Float32Array): ValueRange {
  const sizes = sorted.map(Math.abs).sort();
  const near = sizes.filter((size) => size < 300);
  const sizes_used = near.length > 0.02 * sizes.length ? near : sizes;
  const middle = sizes_used[Math.floor(sizes_used.length / 2)] ?? 0;
  const half_range = Math.max(1, 4 * middle);
  return { low: -half_range, high: half_range };
}

/** Counts of values in equal bins over the range, without values outside it. */
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
