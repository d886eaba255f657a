/** A value with its uncertainty between the limits of its tolerance, readable from two metres. */

import type { Measured } from "../../state/records/scanned";
import { language, text } from "../../text";
import { decimal } from "../../units";

/** Width of the SVG in its own units. */
const WIDTH = 600;

export interface BarPlaces {
  lower: number;
  nominal: number;
  upper: number;
  value: number;
  /** Ends of value ± U. */
  u_from: number;
  u_to: number;
  /** Whether the value is outside the bar and drawn at its edge. */
  beyond: boolean;
}

/**
 * Positions along the bar, 0 to 1: the tolerance occupies the middle half; values far outside are clamped to the
 * edge.
 */
export function barPlaces(nominal: number, tolerance: number, value: number, u: number): BarPlaces {
  const place = (at: number) => 0.5 + (at - nominal) / (4 * tolerance);
  const inside = (at: number) => Math.min(1, Math.max(0, at));
  return {
    lower: place(nominal - tolerance),
    nominal: 0.5,
    upper: place(nominal + tolerance),
    value: inside(place(value)),
    u_from: inside(place(value - u)),
    u_to: inside(place(value + u)),
    beyond: place(value) < 0 || place(value) > 1,
  };
}

export function ToleranceBar({ measured }: { measured: Measured }) {
  const { nominal, tolerance, value, unit } = measured;
  if (nominal === undefined || tolerance === undefined || value === undefined) return null;
  const places = barPlaces(nominal, tolerance, value, measured.expanded_uncertainty ?? 0);
  const x = (place: number) => Math.round(10 + place * (WIDTH - 20));
  const written = (number: number) => `${decimal(number, 3, language.value)} ${unit}`;
  return (
    <svg
      class={`tolerance-bar ${measured.verdict ?? ""}`}
      viewBox={`0 0 ${WIDTH} 96`}
      role="img"
      aria-label={text.value.operate.bar(
        written(nominal - tolerance),
        written(value),
        written(nominal + tolerance),
      )}
    >
      <line class="axis" x1={x(0)} x2={x(1)} y1={40} y2={40} />
      <path class="bracket" d={`M${x(places.lower) + 12} 12H${x(places.lower)}V68h12`} />
      <path class="bracket" d={`M${x(places.upper) - 12} 12H${x(places.upper)}V68h-12`} />
      <line class="nominal" x1={x(0.5)} x2={x(0.5)} y1={26} y2={54} />
      <line class="uncertainty" x1={x(places.u_from)} x2={x(places.u_to)} y1={40} y2={40} />
      <path class="value" d={`M${x(places.value)} 18l13 22l-13 22l-13 -22z`} />
      <text x={x(places.lower)} y={90} text-anchor="middle">
        {written(nominal - tolerance)}
      </text>
      <text x={x(0.5)} y={90} text-anchor="middle">
        {written(nominal)}
      </text>
      <text x={x(places.upper)} y={90} text-anchor="middle">
        {written(nominal + tolerance)}
      </text>
    </svg>
  );
}
