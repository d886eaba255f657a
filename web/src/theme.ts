/** Colours and sizes used by drawing code; all other styles are in `theme.css`. */

/** Okabe–Ito colours of diffraction orders −4…4; they appear inside data views only, always with a label. */
const ORDER_COLOURS: Readonly<Record<number, string>> = {
  [-4]: "#8C564B",
  [-3]: "#D55E00",
  [-2]: "#0072B2",
  [-1]: "#56B4E9",
  0: "#009E73",
  1: "#E69F00",
  2: "#CC79A7",
  3: "#F0E442",
  4: "#999999",
};

/** Colour of lines and points without an order. */
export const NO_ORDER_COLOUR = "#9AA0A6";

/** Value of `order` in the live stream for lines without an order. */
export const NO_ORDER = -128;

/** Colour of a diffraction order, as `#rrggbb`. */
export function orderColour(order: number): string {
  return ORDER_COLOURS[order] ?? NO_ORDER_COLOUR;
}

/** The displayed name of an order: `−2`, `0`, `+1`. */
export function orderName(order: number): string {
  if (order === NO_ORDER) return "–";
  return order > 0 ? `+${order}` : order < 0 ? `−${-order}` : "0";
}

/** Time without messages after which displayed data counts as stale, ms. */
export const STALE_AFTER_MS = 1500;

/** Frame rate requested by live views, Hz. */
export const LIVE_RATE_HZ = 30;
