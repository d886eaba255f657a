/** Scanned parts with their newest measurement, as lists and charts need them. */

import { type Api, data, type Schemas } from "../api/client";

export type Scan = Schemas["ScanDto"];
export type Verdict = "pass" | "fail" | "undecided";

/** What a list shows of a measurement; lengths in mm, angles in degrees. */
export interface Measured {
  id: string;
  at_ms: number;
  tool: string;
  unit: "mm" | "°";
  value: number;
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
  /** Newest first. */
  measured: readonly Measured[];
}

type Damaged = Schemas["DamagedDto"];

/** A part of the list of scanned parts. */
export interface PartsPage {
  parts: ScannedPart[];
  /** Scans between them, and their measurements, that are damaged. */
  damaged: readonly Damaged[];
  /** The cursor of older ones. */
  next: string | undefined;
}

/** What is known of a scan's measurements. */
interface OfScan {
  measured: readonly Measured[];
  damaged: readonly Damaged[];
}

/** What a list shows of a measurement; undefined where it has no value. */
export function measuredOf({ id, created_at_ms, result }: Schemas["MeasurementDto"]): Measured | undefined {
  const told = fields(result);
  const value = number(told.value);
  if (value === undefined || typeof told.tool !== "string") return undefined;
  const verdict = told.verdict;
  return {
    id,
    at_ms: created_at_ms,
    tool: told.tool,
    unit: told.tool === "angle" ? "°" : "mm",
    value,
    expanded_uncertainty: number(told.expanded_uncertainty),
    nominal: number(told.nominal),
    tolerance: number(told.tolerance),
    verdict: verdict === "pass" || verdict === "fail" || verdict === "undecided" ? verdict : undefined,
    rmse_mm: number(fields(told.errors).rmse_mm),
  };
}

/** Reads parts with their measurements; what did not change since is not asked for again. */
export class ScannedParts {
  private readonly known = new Map<string, Promise<OfScan>>();

  constructor(private readonly api: Api) {}

  /** The newest parts, or those before one. */
  async page(limit: number, before?: string): Promise<PartsPage> {
    const query = before === undefined ? { limit } : { limit, before };
    const { items, damaged = [], next } = await data(this.api.GET("/api/v1/scans", { params: { query } }));
    const scans = items as Scan[];
    const of_scans = await Promise.all(scans.map((scan) => this.ofScan(scan.id)));
    return {
      parts: scans.map((scan, at) => ({ scan, measured: of_scans[at]?.measured ?? [] })),
      damaged: [...damaged, ...of_scans.flatMap((of_scan) => of_scan.damaged)],
      next: next ? scans.at(-1)?.id : undefined,
    };
  }

  /** Forgets what is known about a scan's measurements. */
  forget(scan_id: string): void {
    this.known.delete(scan_id);
  }

  /** Forgets everything, for instance after the link was lost. */
  forgetAll(): void {
    this.known.clear();
  }

  private ofScan(scan_id: string): Promise<OfScan> {
    const known = this.known.get(scan_id);
    if (known) return known;
    const asked = this.read(scan_id);
    this.known.set(scan_id, asked);
    // A scan that has just been deleted has no measurements; what failed is asked for again.
    return asked.catch(() => {
      this.known.delete(scan_id);
      return { measured: [], damaged: [] };
    });
  }

  private async read(id: string): Promise<OfScan> {
    const params = { path: { id }, query: { limit: 20 } };
    const { items, damaged = [] } = await data(this.api.GET("/api/v1/scans/{id}/measurements", { params }));
    return { measured: (items as Schemas["MeasurementDto"][]).flatMap((item) => measuredOf(item) ?? []), damaged };
  }
}

function fields(value: unknown): Record<string, unknown> {
  return typeof value === "object" && value !== null ? (value as Record<string, unknown>) : {};
}

function number(value: unknown): number | undefined {
  return typeof value === "number" && Number.isFinite(value) ? value : undefined;
}
