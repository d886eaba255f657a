/** Types of a calibration's results, and its residuals summarized by order. */

import type { Schemas } from "../../../api/client";

export type CalibrationItem = Schemas["CalibrationItemDto"];
export type CalibrationDocument = Schemas["CalibrationDocumentDto"];
export type Light = Schemas["LightSheetsDto"];
export type Summary = Schemas["CalibrationSummaryDto"];
export type Models = Schemas["ModelComparisonDto"];
export type ModelScore = Schemas["ModelScoreDto"];
export type ModelName = Schemas["LightModelNameDto"];
export type StageSummary = Schemas["StageSummaryDto"];
export type AxisSummary = Schemas["AxisSummaryDto"];

/** Residuals of one order over all poses, weighted by points. */
export interface OrderResiduals {
  order: number;
  n_points: number;
  mean_px: number;
  rms_px: number;
  n_outliers: number;
}

export function residualsByOrder(document: CalibrationDocument): OrderResiduals[] {
  const sums = new Map<number, OrderResiduals>();
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
