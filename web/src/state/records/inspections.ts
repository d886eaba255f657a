/** Inspections for lists, tables and bars. All verdicts and reasons come from the server. */

import { type Api, data, type Schemas } from "../../api/client";
import { type Damaged, joinDamaged } from "./damaged";
import { VERDICTS } from "./outcome";
import type { RecordsPage } from "./paged";
import type { Verdict } from "./scanned";

export type Inspection = Schemas["InspectionDto"];
export type CharacteristicResult = Schemas["CharacteristicResultDto"];

/** Filters applied by the server; all records by default. */
export interface InspectionsQuery {
  serial?: string;
  recipe?: string;
  verdict?: Verdict;
  from_ms?: number;
  to_ms?: number;
}

/** The newest inspections, or those older than `before`. */
export async function readInspections(
  api: Api,
  limit: number,
  requested: InspectionsQuery = {},
  before?: string,
): Promise<RecordsPage<Inspection>> {
  const query = { limit, ...requested, ...(before !== undefined && { before }) };
  const { items, damaged = [], next } = await data(api.GET("/api/v1/inspections", { params: { query } }));
  return { items, damaged, next: next ? items.at(-1)?.id : undefined };
}

/** The newest `count` inspected parts; re-evaluations are left out, since no part was scanned for them. */
export async function readNewestParts(api: Api, count: number): Promise<RecordsPage<Inspection>> {
  let items: readonly Inspection[] = [];
  let damaged: readonly Damaged[] = [];
  for (let before: string | undefined; ; ) {
    const page = await readInspections(api, 2 * count, {}, before);
    items = [...items, ...page.items.filter(({ re_evaluated_from }) => !re_evaluated_from)];
    damaged = joinDamaged(damaged, page.damaged);
    before = page.next;
    if (before === undefined || items.length >= count)
      return { items: items.slice(0, count), damaged, next: before };
  }
}

/** Recipe and version in the notation of the API. */
export function versionName({ id, version }: { id: string; version: number }): string {
  return `${id}@${version}`;
}

/** The permitted range of a characteristic; limits are deviations from nominal. */
export function limitsOf({ nominal, lower, upper }: CharacteristicResult) {
  const at = (limit: number | null | undefined) => (limit == null ? undefined : (nominal ?? 0) + limit);
  return { lower: at(lower), upper: at(upper) };
}

/**
 * Distance of a value from the middle of its limits, in half widths of the range: 1 is on a limit. With a single limit:
 * deviation divided by limit. Undefined without value or limits.
 */
export function utilisation(result: CharacteristicResult): number | undefined {
  const { lower, upper, value } = result;
  if (value == null) return undefined;
  const deviation = value - (result.nominal ?? 0);
  if (lower != null && upper != null) return Math.abs(2 * deviation - lower - upper) / (upper - lower);
  const limit = upper ?? lower;
  return limit ? deviation / limit : undefined;
}

/** Sorted by verdict, the worst first, then by utilisation of the limits; those without limits last. */
export function worstFirst(results: readonly CharacteristicResult[]): readonly CharacteristicResult[] {
  const rank = ({ verdict }: CharacteristicResult) => (verdict ? VERDICTS.indexOf(verdict) : -1);
  const used = (result: CharacteristicResult) => utilisation(result) ?? Number.NEGATIVE_INFINITY;
  return [...results].sort((a, b) => rank(b) - rank(a) || (used(b) > used(a) ? 1 : used(b) < used(a) ? -1 : 0));
}
