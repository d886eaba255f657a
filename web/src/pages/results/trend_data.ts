/** Values of one characteristic over parts. */

import type { Measured, ScannedPart } from "../../state/records/scanned";

export interface TrendPoint {
  scan_id: string;
  name: string;
  at_ms: number;
  value: number;
  /** Expanded uncertainty, k = 2; 0 if unknown. */
  u: number;
  bad: boolean;
}

export interface Trend {
  unit: string;
  /** Oldest first. */
  points: readonly TrendPoint[];
  nominal: number | undefined;
  tolerance: number | undefined;
}

/** The key of a characteristic: its tool, and its name if any. */
export function characteristicOf({ tool, name }: Measured): string {
  return name === undefined ? tool : `${tool}/${name}`;
}

/** Characteristics that were measured on at least one part, the most used first. */
export function characteristicsOf(parts: readonly ScannedPart[]): readonly string[] {
  const uses = new Map<string, number>();
  for (const part of parts) {
    for (const one of part.measured) uses.set(characteristicOf(one), (uses.get(characteristicOf(one)) ?? 0) + 1);
  }
  return [...uses].sort((a, b) => b[1] - a[1]).map(([characteristic]) => characteristic);
}

/**
 * The current measurement of the characteristic on each part; limits are those of the newest measurement that has
 * them.
 */
export function trendOf(parts: readonly ScannedPart[], characteristic: string): Trend {
  const rows = parts.flatMap((part) => {
    const measured = part.measured.find((one) => characteristicOf(one) === characteristic);
    return measured?.value === undefined ? [] : [{ part, measured, value: measured.value }];
  });
  rows.sort((a, b) => a.part.scan.created_at_ms - b.part.scan.created_at_ms);
  const limits: Measured | undefined = rows.findLast(({ measured }) => measured.tolerance !== undefined)?.measured;
  return {
    unit: rows[0]?.measured.unit ?? "mm",
    points: rows.map(({ part, measured, value }) => ({
      scan_id: part.scan.id,
      name: part.scan.name,
      at_ms: part.scan.created_at_ms,
      value,
      u: measured.expanded_uncertainty ?? 0,
      bad: measured.verdict === "not_ok" || measured.verdict === "invalid",
    })),
    nominal: limits?.nominal,
    tolerance: limits?.tolerance,
  };
}
