/** Values of one characteristic over parts. */

import type { Measured, ScannedPart } from "../../state/scanned";

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

/** Tools by which at least one part was measured, the most used first. */
export function toolsOf(parts: readonly ScannedPart[]): readonly string[] {
  const uses = new Map<string, number>();
  for (const part of parts) {
    for (const tool of new Set(part.measured.map((one) => one.tool))) uses.set(tool, (uses.get(tool) ?? 0) + 1);
  }
  return [...uses].sort((a, b) => b[1] - a[1]).map(([tool]) => tool);
}

/** The newest measurement of each part by `tool`; limits are those of the newest measurement that has them. */
export function trendOf(parts: readonly ScannedPart[], tool: string): Trend {
  const rows = parts.flatMap((part) => {
    const measured = part.measured.find((one) => one.tool === tool);
    return measured ? [{ part, measured }] : [];
  });
  rows.sort((a, b) => a.part.scan.created_at_ms - b.part.scan.created_at_ms);
  const limits: Measured | undefined = rows.findLast(({ measured }) => measured.tolerance !== undefined)?.measured;
  return {
    unit: rows[0]?.measured.unit ?? "mm",
    points: rows.map(({ part, measured }) => ({
      scan_id: part.scan.id,
      name: part.scan.name,
      at_ms: part.scan.created_at_ms,
      value: measured.value,
      u: measured.expanded_uncertainty ?? 0,
      bad: measured.verdict === "fail" || part.scan.state === "invalid",
    })),
    nominal: limits?.nominal,
    tolerance: limits?.tolerance,
  };
}
