/** Which inspections the statistics are about, stored in the query of the URL. */

import { dayStart } from "../results/filter";

export const FIELDS = [
  "characteristic",
  "version",
  "serial",
  "order",
  "from",
  "to",
  "limit",
  "reference",
  "sigmas",
] as const;

/** Text as in the URL; days as `YYYY-MM-DD` of this browser's time zone, both included. Empty: no limit. */
export type Selection = Record<(typeof FIELDS)[number], string>;

/** Numbers of values that can be chosen; the server's default first. */
export const LIMITS = ["125", "25", "500", "5000"] as const;

export function selectionOf(query: URLSearchParams): Selection {
  return Object.fromEntries(FIELDS.map((name) => [name, query.get(name)?.trim() ?? ""])) as Selection;
}

/** The query of the URL: only the fields that are set. */
export function queryOf(selection: Selection): Record<string, string> {
  return Object.fromEntries(Object.entries(selection).filter(([, value]) => value !== ""));
}

export interface SeriesQuery {
  version?: number;
  serial?: string;
  order?: string;
  from_ms?: number;
  to_ms?: number;
  limit?: number;
}

/** The query sent to the server. */
export function seriesQuery({ version, serial, order, from, to, limit }: Selection): SeriesQuery {
  const [from_ms, to_ms] = [dayStart(from, 0), dayStart(to, 1)];
  const [numbered, at_most] = [wholeNumber(version), wholeNumber(limit)];
  return {
    ...(numbered !== undefined && { version: numbered }),
    ...(serial && { serial }),
    ...(order && { order }),
    ...(from_ms !== undefined && { from_ms }),
    ...(to_ms !== undefined && { to_ms }),
    ...(at_most !== undefined && { limit: at_most }),
  };
}

/** A number from 1, `undefined` for any other text. */
function wholeNumber(text: string): number | undefined {
  return /^[1-9]\d*$/.test(text) ? Number(text) : undefined;
}

/** The value from the certificate as in the URL, with a decimal point. */
export function referenceOf({ reference }: Selection): number | undefined {
  return reference === "" || !Number.isFinite(Number(reference)) ? undefined : Number(reference);
}
