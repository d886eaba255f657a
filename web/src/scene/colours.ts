/** What the colours of a cloud mean, and which colours they are. Shared by shader, legend and histogram. */

import { orderColour } from "../theme";

export const COLOUR_MODES = ["order", "height", "sigma", "intensity", "deviation"] as const;
export type ColourMode = (typeof COLOUR_MODES)[number];

/** Modes with a range: everything but the order. */
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
  /** Points outside of the range are left out; else they get the colour of its end. */
  hide_outside: boolean;
}

export type Rgb = readonly [number, number, number];

/** Stops of a palette, equally spaced from low to high. */
export const PALETTE_STOPS = 9;

/** Viridis: ordered in lightness, readable without telling red from green. */
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

/** Blue below, light grey on the surface, red above. */
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

/** Colours of a mode from low to high. Near the camera is high, so heights run against z. */
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

/** `#rrggbb` as three numbers from 0 to 1. */
export function rgb(hex: string): Rgb {
  const channel = (at: number) => Number.parseInt(hex.slice(at, at + 2), 16) / 255;
  return [channel(1), channel(3), channel(5)];
}

/** The colour of a value, as the shader computes it. */
export function colourOf(value: number, mode: ValueMode, { low, high }: ValueRange): Rgb {
  const stops = palette(mode);
  const share = high > low ? Math.min(1, Math.max(0, (value - low) / (high - low))) : 0.5;
  const place = share * (PALETTE_STOPS - 1);
  const first = Math.min(Math.floor(place), PALETTE_STOPS - 2);
  const [from, to] = [rgb(stops[first] ?? ""), rgb(stops[first + 1] ?? "")];
  const mix = (channel: 0 | 1 | 2) => from[channel] + (place - first) * (to[channel] - from[channel]);
  return [mix(0), mix(1), mix(2)];
}

/** A palette as CSS gradient, low at the left. */
export function gradient(mode: ValueMode): string {
  return `linear-gradient(to right, ${palette(mode).join(", ")})`;
}
