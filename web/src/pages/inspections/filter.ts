/** The filter of the list, stored in the query of the URL. */

import type { InspectionsQuery } from "../../state/records/inspections";
import { VERDICTS } from "../../state/records/outcome";
import { dayStart } from "../results/filter";

export const FILTERS = ["serial", "recipe", "verdict", "from", "to"] as const;

/** Text as typed; days as `YYYY-MM-DD` of this browser's time zone, both included. Empty: no limit. */
export type InspectionFilter = Record<(typeof FILTERS)[number], string>;

export function filterOf(query: URLSearchParams): InspectionFilter {
  const text = (name: keyof InspectionFilter) => query.get(name)?.trim() ?? "";
  return {
    serial: text("serial"),
    recipe: text("recipe"),
    verdict: text("verdict"),
    from: text("from"),
    to: text("to"),
  };
}

/** The query of the URL: only the fields that are set. */
export function queryOf(filter: InspectionFilter): Record<string, string> {
  return Object.fromEntries(Object.entries(filter).filter(([, value]) => value !== ""));
}

/** The URL of all inspections that match the filter, as a file. */
export function exportHref(filter: InspectionFilter, format: "csv" | "dfq"): string {
  const query = Object.entries(serverQuery(filter)).map(([name, value]) => [name, `${value}`]);
  return `/api/v1/inspections/export?${new URLSearchParams([["format", format], ...query])}`;
}

/** The query sent to the server. */
export function serverQuery({ serial, recipe, verdict, from, to }: InspectionFilter): InspectionsQuery {
  const known = VERDICTS.find((one) => one === verdict);
  const [from_ms, to_ms] = [dayStart(from, 0), dayStart(to, 1)];
  return {
    ...(serial && { serial }),
    ...(recipe && { recipe }),
    ...(known && { verdict: known }),
    ...(from_ms !== undefined && { from_ms }),
    ...(to_ms !== undefined && { to_ms }),
  };
}
