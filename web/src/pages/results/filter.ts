/** The filter of the results, stored in the query of the URL and applied by the server. */

import { OUTCOMES, type Outcome } from "../../state/records/outcome";
import type { PartsQuery } from "../../state/records/scanned";

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

/** The query sent to the server. */
export function serverQuery({ name, outcome, from_day, to_day }: ResultFilter): PartsQuery {
  const [from_ms, to_ms] = [dayStart(from_day, 0), dayStart(to_day, 1)];
  const wanted = name.trim();
  return {
    ...(wanted && { name: wanted }),
    ...withOutcome(outcome),
    ...(from_ms !== undefined && { from_ms }),
    ...(to_ms !== undefined && { to_ms }),
  };
}

/** The inverse of `outcomeOf`: what parts with an outcome have in common. */
function withOutcome(outcome: Outcome | ""): PartsQuery {
  switch (outcome) {
    case "":
      return {};
    case "partial":
      return { judged: false, state: "partial" };
    case "measured":
      return { judged: false, state: "complete", measured: true };
    case "scanned":
      return { judged: false, state: "complete", measured: false };
    default:
      return { verdict: outcome };
  }
}

/** Start of the day `later` days after `day`, local time, ms since 1970. */
export function dayStart(day: string, later: number): number | undefined {
  const [year, month, date] = day.split("-").map(Number);
  if (!year || !month || !date) return undefined;
  return new Date(year, month - 1, date + later).getTime();
}
