/** What a calibration says about itself: the parts of its record that this page reads. */

import type { Schemas } from "../../api/client";

export const MODELS = ["planes", "pencil", "grating"] as const;
export type ModelName = (typeof MODELS)[number];

/** Error of one light model on poses that were left out of its fit; `null`: it could not be fitted. */
export interface ModelScore {
  model: ModelName;
  held_out_rms_px: number | null;
  held_out_rms_mm: number | null;
  held_out_bias_mm: number | null;
  fit_rms_px: number | null;
  failure: string | null;
}

export interface Models {
  scores: readonly ModelScore[];
  recommended: ModelName;
}

export interface StageFigures {
  /** Travel per mm in the camera frame. */
  direction: readonly [number, number, number];
  /** σ of `direction`. */
  sigma: readonly [number, number, number];
  scale_error: number;
  scale_sigma: number;
  straightness_rms_um: number;
  /** Position in mm; deviation along, and two across, in µm. */
  straightness_um: readonly (readonly [number, number, number, number])[];
}

/** Figures of a calibration, as lists carry them. */
export interface Summary {
  corner_rms_px: number;
  model: ModelName | null;
  light_rms_px: number | null;
  /** What the calibration leaves of depth uncertainty over the working volume. */
  systematic_sigma_mm: number | null;
  models: Models | null;
  n_poses: number;
  n_laser_poses: number;
  n_stage_views: number;
  depth_near_mm: number;
  depth_far_mm: number;
  stage: StageFigures | null;
  warnings: readonly string[];
  left_out: readonly string[];
}

/** Light sheets as the document writes them. */
export type Light =
  | { model: "planes"; planes: readonly { order: number; normal: readonly [number, number, number] }[] }
  | { model: "pencil"; wavelength_over_period: number }
  | {
      model: "grating";
      wavelength_over_period: number;
      axis: readonly [number, number, number];
      groove: readonly [number, number, number];
      normal: readonly [number, number, number];
    };

/** The document `sheaf-calibration/1`, as far as it is shown here. */
export interface CalibrationDocument {
  orders: readonly number[];
  light: Light;
  report: {
    light: {
      /** Estimate, σ, data sheet; `null` for free planes. */
      wavelength_over_period: readonly [number, number, number] | null;
      lines: readonly {
        pose: string;
        order: number;
        n_points: number;
        mean_px: number;
        rms_px: number;
        n_outliers: number;
      }[];
    } | null;
  };
}

export type CalibrationItem = Schemas["CalibrationItemDto"];

/** A calibration's figures. The interface leaves their shape open, the server writes this one. */
export function summaryOf(item: CalibrationItem): Summary {
  return item.summary as Summary;
}

export function documentOf(calibration: Schemas["CalibrationDto"]): CalibrationDocument {
  return calibration.calibration as CalibrationDocument;
}

/** Residuals of one order over all poses, weighted by points. */
export interface OrderSum {
  order: number;
  n_points: number;
  mean_px: number;
  rms_px: number;
  n_outliers: number;
}

export function orderSums(document: CalibrationDocument): OrderSum[] {
  const sums = new Map<number, OrderSum>();
  for (const line of document.report.light?.lines ?? []) {
    const sum = sums.get(line.order) ?? { order: line.order, n_points: 0, mean_px: 0, rms_px: 0, n_outliers: 0 };
    sum.n_points += line.n_points;
    sum.mean_px += line.n_points * line.mean_px;
    sum.rms_px += line.n_points * line.rms_px ** 2;
    sum.n_outliers += line.n_outliers;
    sums.set(line.order, sum);
  }
  return [...sums.values()]
    .sort((a, b) => a.order - b.order)
    .map((sum) => ({
      ...sum,
      mean_px: sum.mean_px / Math.max(1, sum.n_points),
      rms_px: Math.sqrt(sum.rms_px / Math.max(1, sum.n_points)),
    }));
}
