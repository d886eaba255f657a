/** How the rows of a scan are captured: motion and exposures. */

export const MODES = ["stop_and_go", "continuous"] as const;
export type Mode = (typeof MODES)[number];

/** Selectable numbers of exposures per row. */
export const EXPOSURE_COUNTS = [1, 2, 3, 4] as const;

/** Ratio of successive exposures of a row; an 8-bit image covers about 12 : 1. */
const EXPOSURE_RATIO = 6;

/** Default of the longest exposure, several times that of matt grey paint, µs. */
export const FIRST_LONGEST_US = 4000;

/** `n` exposures up to the longest, in ascending order, whole µs. */
export function exposuresUpTo(longest_us: number, n: number): number[] {
  return Array.from({ length: n }, (_, at) => Math.round(longest_us / EXPOSURE_RATIO ** (n - 1 - at)));
}
