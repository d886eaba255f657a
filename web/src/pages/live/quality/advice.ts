/** What the histogram of a frame says about its exposure. */

/** Pixels at full scale of which a highlight may have some; from here on lines are flattened. */
const SATURATED_FROM = 2e-4;

/** The brightest pixels of a frame: so many belong to laser lines that are 3 px wide on a tenth of the columns. */
const BRIGHTEST = 2e-3;

/** Below this share of full scale the brightest pixels drown in noise. */
const DIM_BELOW = 0.3;

export interface Advice {
  kind: "over" | "under" | "good";
  /** Share of all pixels at full scale. */
  saturated: number;
  /** How bright the brightest 0.2 % of the pixels are at least, as share of full scale. */
  bright: number;
}

/** Judges a histogram of equal bins up to full scale; `undefined` without pixels. */
export function adviceOf(histogram: Uint32Array, n_saturated: number): Advice | undefined {
  const n_pixels = histogram.reduce((sum, n) => sum + n, 0);
  if (n_pixels === 0) return undefined;
  const saturated = n_saturated / n_pixels;
  const bright = levelOfBrightest(histogram, BRIGHTEST * n_pixels);
  const kind = saturated > SATURATED_FROM ? "over" : bright < DIM_BELOW ? "under" : "good";
  return { kind, saturated, bright };
}

/** The middle of the bin down to which the brightest `n` pixels reach, as share of full scale. */
function levelOfBrightest(histogram: Uint32Array, n: number): number {
  let brighter = 0;
  for (let bin = histogram.length - 1; bin >= 0; bin--) {
    brighter += histogram[bin] ?? 0;
    if (brighter >= n) return (bin + 0.5) / histogram.length;
  }
  return 0;
}
