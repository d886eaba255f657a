/** Colour modes and palettes of the point cloud, shared by shader, legend and histogram. */

import { orderColour } from "../theme";

export const COLOUR_MODES = ["order", "height", "sigma", "intensity", "deviation"] as const;
export type ColourMode = (typeof COLOUR_MODES)[number];

/** Modes with a range of values: all but the order. */
export type ValueMode = Exclude<ColourMode, "order">;

/** From low to high, in the unit of the mode: mm (height), µm (σ, deviation), grey levels (intensity). */
export interface ValueRange {
  low: number;
  high: number;
}

/** How a cloud is coloured. */
export interface Colouring {
  mode: ColourMode;
  range: ValueRange;
  /** Whether points outside the range are hidden; otherwise they have the colour of its end. */
  hide_outside: boolean;
}

export type Rgb = readonly [number, number, number];

/** Number of stops of a palette, equally spaced from low to high. */
export const PALETTE_STOPS = 9;

/** Viridis: monotonic in lightness, readable with colour vision deficiency. */
const SEQUENTIAL = [
  "#440154",
  "#472d7b",
  "#3b528b",
  "#2c728e",
  "#21918c",
  "#28ae80",
  "#5ec962",
  "#addc30",
  "#fde725",
];

/** Blue for negative, light grey for zero, red for positive deviations. */
const DIVERGING = [
  "#2166ac",
  "#4393c3",
  "#92c5de",
  "#d1e5f0",
  "#f2f2f2",
  "#fddbc7",
  "#f4a582",
  "#d6604d",
  "#b2182b",
];

/** Colours of a mode from low to high. Near the camera is high, so heights are opposite to z. */
export function palette(mode: ValueMode): readonly string[] {
  if (mode === "deviation") return DIVERGING;
  return mode === "height" ? [...SEQUENTIAL].reverse() : SEQUENTIAL;
}

/** Lowest order with a colour of its own in the shader's table. */
export const FIRST_ORDER = -4;
export const N_ORDERS = 9;

/** Colours of the orders from `FIRST_ORDER` on, then that of points without one. */
export function orderTable(): Rgb[] {
  const orders = Array.from({ length: N_ORDERS }, (_, idx) => orderColour(FIRST_ORDER + idx));
  return [...orders, orderColour(Number.NaN)].map(rgb);
}

/** Converts `#rrggbb` to three numbers from 0 to 1. */
export function rgb(hex: string): Rgb {
  const channel = (at: number) => Number.parseInt(hex.slice(at, at + 2), 16) / 255;
  return [channel(1), channel(3), channel(5)];
}

/** A palette as CSS gradient, low at the left. */
export function gradient(mode: ValueMode): string {
  return `linear-gradient(to right, ${palette(mode).join(", ")})`;
}
