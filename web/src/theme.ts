/** Colours and sizes that drawing code needs; everything else about looks is in `theme.css`. */

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

/** The order of a line that has none, as the live stream writes it. */
export const NO_ORDER = -128;

/** Colour of a diffraction order, as `#rrggbb`. */
export function orderColour(order: number): string {
  return ORDER_COLOURS[order] ?? NO_ORDER_COLOUR;
}

/** The name of an order as people read it: `−2`, `0`, `+1`. */
export function orderName(order: number): string {
  if (order === NO_ORDER) return "–";
  return order > 0 ? `+${order}` : order < 0 ? `−${-order}` : "0";
}

/** After so long without a word from the server, what is shown is called stale. */
export const STALE_AFTER_MS = 1500;

/** Frames per second that the live views ask for. */
export const LIVE_RATE_HZ = 30;
