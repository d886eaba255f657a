/** The filter of the results. */

import { OUTCOMES, type Outcome, outcomeOf, VERDICTS } from "../../state/records/outcome";
import type { PartsQuery, ScannedPart } from "../../state/records/scanned";

export interface ResultFilter {
  /** Part of the name, case-insensitive. */
  name: string;
  outcome: Outcome | "";
  /** Days as `YYYY-MM-DD` of this browser's time zone, both included; empty: no limit. */
  from_day: string;
  to_day: string;
}

export const NO_FILTER: ResultFilter = { name: "", outcome: "", from_day: "", to_day: "" };

/** The filter in the query of the URL. */
export function filterOf(query: URLSearchParams): ResultFilter {
  const text = (name: string) => query.get(name) ?? "";
  const outcome = OUTCOMES.find((outcome) => outcome === query.get("outcome")) ?? "";
  return { name: text("name"), outcome, from_day: text("from"), to_day: text("to") };
}

/** The query of the URL: only the fields that are set. */
export function queryOf({ name, outcome, from_day, to_day }: ResultFilter): Record<string, string> {
  const all = { name, outcome, from: from_day, to: to_day };
  return Object.fromEntries(Object.entries(all).filter(([, value]) => value !== ""));
}

/** The part of the filter that the server applies to all records. */
export function serverQuery(outcome: Outcome | ""): PartsQuery {
  const verdict = VERDICTS.find((verdict) => verdict === outcome);
  if (verdict) return { verdict };
  return outcome === "partial" ? { state: "partial" } : {};
}

export function filtered(parts: readonly ScannedPart[], filter: ResultFilter): readonly ScannedPart[] {
  const name = filter.name.trim().toLowerCase();
  const [from_ms, to_ms] = [dayStart(filter.from_day, 0), dayStart(filter.to_day, 1)];
  return parts.filter((part) => {
    const { scan } = part;
    if (!scan.name.toLowerCase().includes(name)) return false;
    if (filter.outcome !== "" && outcomeOf(part) !== filter.outcome) return false;
    if (from_ms !== undefined && scan.created_at_ms < from_ms) return false;
    return to_ms === undefined || scan.created_at_ms < to_ms;
  });
}

/** Start of the day `later` days after `day`, local time, ms since 1970. */
export function dayStart(day: string, later: number): number | undefined {
  const [year, month, date] = day.split("-").map(Number);
  if (!year || !month || !date) return undefined;
  return new Date(year, month - 1, date + later).getTime();
}
