/** Advice on the exposure from the histogram of a frame. */

/** Share of saturated pixels above which lines are saturated, not only highlights. */
const SATURATED_FROM = 2e-4;

/** Share of pixels evaluated as the brightest: that of a line 3 px wide in a tenth of the columns. */
const BRIGHTEST = 2e-3;

/** Share of full scale below which the brightest pixels have a poor signal-to-noise ratio. */
const DIM_BELOW = 0.3;

export interface Advice {
  kind: "over" | "under" | "good";
  /** Share of all pixels at full scale. */
  saturated: number;
  /** Minimum brightness of the brightest 0.2 % of the pixels, as a share of full scale. */
  bright: number;
}

/** Evaluates a histogram of equal bins up to full scale; `undefined` without pixels. */
export function adviceOf(histogram: Uint32Array, n_saturated: number): Advice | undefined {
  const n_pixels = histogram.reduce((sum, n) => sum + n, 0);
  if (n_pixels === 0) return undefined;
  const saturated = n_saturated / n_pixels;
  const bright = levelOfBrightest(histogram, BRIGHTEST * n_pixels);
  const kind = saturated > SATURATED_FROM ? "over" : bright < DIM_BELOW ? "under" : "good";
  return { kind, saturated, bright };
}

/** Centre of the darkest bin among the brightest `n` pixels, as a share of full scale. */
function levelOfBrightest(histogram: Uint32Array, n: number): number {
  let brighter = 0;
  for (let bin = histogram.length - 1; bin >= 0; bin--) {
    brighter += histogram[bin] ?? 0;
    if (brighter >= n) return (bin + 0.5) / histogram.length;
  }
  return 0;
}
