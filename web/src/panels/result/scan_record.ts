/** What the JSON of scans and measurements holds that the page shows; anything may be missing in a partial scan. */

import type { Schemas } from "../../api/client";
import type { SurfaceRegion } from "../../scene/region";
import type { FittedShape } from "../../scene/shapes";
import type { Tool } from "../../state/choices";
import { VERDICTS } from "../../state/outcome";
import type { Verdict } from "../../state/scanned";

export type Scan = Schemas["ScanDto"];
export type Measurement = Schemas["MeasurementDto"];

/** How two orders that saw the same place agree. */
export interface OrderPair {
  order_a: number;
  order_b: number;
  n_pairs: number;
  bias_mm: number;
  rms_mm: number;
}

/** Figures of a scan. */
export interface ScanReport {
  n_points?: number;
  n_frames?: number;
  median_sigma_mm?: number;
  losses?: string[];
  left_out?: { reason: string; n_points: number; n_pieces: number }[];
  self_consistency?: OrderPair[];
  stopped?: string;
}

/** How a scan was run. */
export interface ScanPlanRecord {
  from_mm?: number;
  to_mm?: number;
  step_mm?: number;
  mode?: "stop_and_go" | "continuous";
  exposure_us?: number;
  laser_power?: number;
}

/** A measured value with all that is needed to judge it. */
export interface MeasurementResult {
  /** Null: it could not be measured; the notes say why. */
  value: number | null;
  unit: string;
  nominal: number | null;
  error: number | null;
  expanded_uncertainty: number | null;
  tolerance: number | null;
  verdict: string | null;
  errors: { n_points: number; rmse_mm: number; max_mm: number } | null;
  features: {
    role: string;
    shape: FittedShape;
    n_points: number;
    rms_mm: number;
    /** Where its points are; missing in results of earlier versions. */
    region?: SurfaceRegion | null;
  }[];
  per_order: { order: number; value_mm: number | null; errors: { n_points: number; rmse_mm: number } }[];
  notes: string[];
}

export interface MeasurementRequest {
  tool: Tool;
  name?: string | null;
  nominal_mm: number | null;
  tolerance_mm: number | null;
}

export const reportOf = (scan: Scan) => (scan.report ?? {}) as ScanReport;
export const planOf = (scan: Scan) => (scan.plan ?? {}) as ScanPlanRecord;
export const resultOf = (measurement: Measurement) => measurement.result as MeasurementResult;
export const requestOf = (measurement: Measurement) => measurement.request as MeasurementRequest;

export function verdictOf(measurement: Measurement): Verdict | undefined {
  const { verdict } = resultOf(measurement);
  return VERDICTS.find((known) => known === verdict);
}
