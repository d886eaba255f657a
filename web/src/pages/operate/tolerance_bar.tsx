/** A value with its uncertainty between the limits of its tolerance, readable from two metres. */

import type { Verdict } from "../../state/records/scanned";
import { language, text } from "../../text";
import { decimal } from "../../units";

/** Width of the SVG in its own units. */
const WIDTH = 600;

/** Labels closer than this fraction of the bar would overlap. */
const LABEL_FRACTION = 0.19;

/** A value and its limits, all in the same unit. */
export interface Limited {
  nominal: number | undefined;
  lower: number | undefined;
  upper: number | undefined;
  value: number;
  /** Expanded uncertainty; 0 if unknown. */
  u: number;
}

export interface BarPlaces {
  lower: number | undefined;
  nominal: number | undefined;
  upper: number | undefined;
  value: number;
  /** Ends of value ± U. */
  u_from: number;
  u_to: number;
  /** Whether the value is outside the bar and drawn at its edge. */
  beyond: boolean;
}

/**
 * Positions along the bar, 0 to 1: the tolerance occupies the middle half; values far outside are clamped to the edge.
 * With a single limit the tolerance begins at nominal. Undefined without a range.
 */
export function barPlaces({ nominal, lower, upper, value, u }: Limited): BarPlaces | undefined {
  const [from, to] = [lower ?? nominal, upper ?? nominal];
  if (from === undefined || to === undefined || !(to > from)) return undefined;
  const place = (at: number) => 0.25 + (0.5 * (at - from)) / (to - from);
  const inside = (at: number) => Math.min(1, Math.max(0, at));
  const placed = (at: number | undefined) => (at === undefined ? undefined : place(at));
  return {
    lower: placed(lower),
    nominal: placed(nominal),
    upper: placed(upper),
    value: inside(place(value)),
    u_from: inside(place(value - u)),
    u_to: inside(place(value + u)),
    beyond: place(value) < 0 || place(value) > 1,
  };
}

interface Properties {
  limited: Limited;
  unit: string;
  verdict: Verdict | undefined;
}

export function ToleranceBar({ limited, unit, verdict }: Properties) {
  const places = barPlaces(limited);
  if (!places) return null;
  const x = (place: number) => Math.round(10 + place * (WIDTH - 20));
  const written = (number: number | undefined) =>
    number === undefined ? "–" : `${decimal(number, 3, language.value)} ${unit}`;
  const { lower, nominal, upper, value } = limited;
  const is_near = (limit: number | undefined) =>
    limit !== undefined && Math.abs(limit - (places.nominal ?? limit)) < LABEL_FRACTION;
  const bracket = (place: number | undefined, inward: number) =>
    place !== undefined && <path class="bracket" d={`M${x(place) + inward} 12H${x(place)}V68h${inward}`} />;
  const label = (place: number | undefined, number: number | undefined) =>
    place !== undefined && (
      <text x={x(place)} y={90} text-anchor="middle">
        {written(number)}
      </text>
    );
  return (
    <svg
      class={`tolerance-bar ${verdict ?? ""}`}
      viewBox={`0 0 ${WIDTH} 96`}
      role="img"
      aria-label={text.value.operate.bar(written(lower), written(value), written(upper))}
    >
      <line class="axis" x1={x(0)} x2={x(1)} y1={40} y2={40} />
      {bracket(places.lower, 12)}
      {bracket(places.upper, -12)}
      {places.nominal !== undefined && (
        <line class="nominal" x1={x(places.nominal)} x2={x(places.nominal)} y1={26} y2={54} />
      )}
      <line class="uncertainty" x1={x(places.u_from)} x2={x(places.u_to)} y1={40} y2={40} />
      <path class="value" d={`M${x(places.value)} 18l13 22l-13 22l-13 -22z`} />
      {label(places.lower, lower)}
      {!is_near(places.lower) && !is_near(places.upper) && label(places.nominal, nominal)}
      {label(places.upper, upper)}
    </svg>
  );
}
