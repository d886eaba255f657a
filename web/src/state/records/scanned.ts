/** Scanned parts with verdict and characteristics for lists and charts, from one endpoint of the server. */

import { type Api, data, type Schemas } from "../../api/client";
import type { Damaged } from "./damaged";

export type Scan = Schemas["ScanDto"];
export type Verdict = Schemas["VerdictDto"];

/** The current measurement of a characteristic; lengths in mm, angles in degrees. */
export interface Measured {
  id: string;
  at_ms: number;
  tool: string;
  /** Undefined if it is the only one of its tool. */
  name: string | undefined;
  unit: "mm" | "°";
  /** Undefined if it could not be measured. */
  value: number | undefined;
  /** Expanded uncertainty, k = 2. */
  expanded_uncertainty: number | undefined;
  nominal: number | undefined;
  /** Symmetric around the nominal. */
  tolerance: number | undefined;
  verdict: Verdict | undefined;
  rmse_mm: number | undefined;
}

export interface ScannedPart {
  scan: Scan;
  /** Newest first, one per characteristic. */
  measured: readonly Measured[];
}

/** Filters applied by the server; all records by default. */
export interface PartsQuery {
  /** Part of the name, case-insensitive. */
  name?: string;
  from_ms?: number;
  to_ms?: number;
  verdict?: Verdict;
  /** With or without a verdict. */
  judged?: boolean;
  /** With or without a measurement. */
  measured?: boolean;
  state?: Schemas["ScanStateDto"];
  purpose?: Schemas["ScanPurposeDto"];
}

/** A page of the list of scanned parts. */
export interface PartsPage {
  parts: readonly ScannedPart[];
  /** Damaged scans and measurements in the range of the page. */
  damaged: readonly Damaged[];
  /** Cursor of the next, older page. */
  next: string | undefined;
}

export function partOf(scan: Scan): ScannedPart {
  return { scan, measured: scan.characteristics.map(measuredOf) };
}

function measuredOf(one: Schemas["CharacteristicDto"]): Measured {
  return {
    id: one.measurement_id,
    at_ms: one.created_at_ms,
    tool: one.tool,
    name: one.name ?? undefined,
    unit: one.unit === "°" ? "°" : "mm",
    value: one.value ?? undefined,
    expanded_uncertainty: one.expanded_uncertainty ?? undefined,
    nominal: one.nominal ?? undefined,
    tolerance: one.tolerance ?? undefined,
    verdict: one.verdict ?? undefined,
    rmse_mm: one.rmse_mm ?? undefined,
  };
}

/** The newest parts, or those older than `before`. */
export async function readParts(
  api: Api,
  limit: number,
  requested: PartsQuery = {},
  before?: string,
): Promise<PartsPage> {
  const query = { limit, ...requested, ...(before !== undefined && { before }) };
  const { items, damaged = [], next } = await data(api.GET("/api/v1/scans", { params: { query } }));
  return { parts: items.map(partOf), damaged, next: next ? items.at(-1)?.id : undefined };
}
