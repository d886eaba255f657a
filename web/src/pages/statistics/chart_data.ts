/** What a control chart shows: values, lines, and the points that violate run rules. */

import type { Schemas } from "../../api/client";

export type ControlChart = Schemas["ControlChartDto"];
export type Violation = Schemas["ViolationDto"];

export type LineName = "centre" | "lower_control" | "upper_control" | "lower_limit" | "upper_limit";

export interface Line {
  name: LineName;
  value: number;
}

export interface ChartData {
  /** Oldest first; null: not measured. */
  values: readonly (number | null)[];
  lines: readonly Line[];
  /** Rules violated by the pattern that ends at this index. */
  violated: ReadonlyMap<number, readonly number[]>;
  /** Whether the smallest possible value is zero. */
  from_zero: boolean;
}

/** Specification limits further outside than this multiple of the other values' range would flatten the chart. */
const LARGEST_STRETCH = 3;

/** The chart of individual values. */
export function individualsOf(chart: ControlChart): ChartData {
  const values = chart.readings.map(({ value }) => value ?? null);
  const lines = controlLines(chart.individuals);
  const [low, high] = extent([...values, ...lines.map(({ value }) => value)]);
  const specified: readonly (readonly [LineName, number | null | undefined])[] = [
    ["lower_limit", chart.lower_limit],
    ["upper_limit", chart.upper_limit],
  ];
  const near = (value: number) => {
    const [from, to] = extent([low, high, value]);
    return to - from <= LARGEST_STRETCH * (high - low);
  };
  const limits = specified.flatMap(([name, value]) => (value != null && near(value) ? [{ name, value }] : []));
  return { values, lines: [...lines, ...limits], violated: violatedAt(chart.violations), from_zero: false };
}

/** The chart of moving ranges: differences of successive values; none at the first value and beside gaps. */
export function movingRangesOf(chart: ControlChart): ChartData {
  const values = chart.readings.map(({ value }, idx) => {
    const before = chart.readings[idx - 1]?.value;
    return value == null || before == null ? null : Math.abs(value - before);
  });
  // The lower limit of moving ranges is zero.
  const lines = controlLines(chart.moving_range).filter(({ name }) => name !== "lower_control");
  const { upper } = chart.moving_range;
  const beyond = values.flatMap((value, idx) => (value !== null && value > upper ? [[idx, [1]] as const] : []));
  return { values, lines, violated: new Map(beyond), from_zero: true };
}

function controlLines({ lower, centre, upper }: Schemas["ControlLimitsDto"]): readonly Line[] {
  return [
    { name: "lower_control", value: lower },
    { name: "centre", value: centre },
    { name: "upper_control", value: upper },
  ];
}

/** Lowest and highest of the values. */
export function extent(values: readonly (number | null)[]): [number, number] {
  const known = values.filter((value) => value !== null);
  return known.length === 0 ? [0, 1] : [Math.min(...known), Math.max(...known)];
}

/** The rules by the last point of their patterns. */
export function violatedAt(violations: readonly Violation[]): ReadonlyMap<number, readonly number[]> {
  const at = new Map<number, number[]>();
  for (const { rule, last_idx } of violations) {
    const rules = at.get(last_idx) ?? [];
    at.set(last_idx, [...rules.filter((known) => known !== rule), rule].sort());
  }
  return at;
}
