/** Interprets the comparison of the three light models, and computes the angles of the orders. */

import { dot, type Vec3, vec3 } from "../../../scene/cloud/shapes";
import type { CalibrationDocument, Light, ModelName, Models } from "./summary";

/** Below this ratio the errors of two models are indistinguishable with a dozen poses. */
const ALIKE_RATIO = 1.5;

export type Recommendation =
  /** The light sheets are curved; plane models have a systematic error. */
  | { kind: "curved"; use: ModelName; worst_mm: number; best_mm: number }
  /** All models predict equally well: the simplest is sufficient. */
  | { kind: "alike"; use: ModelName; best_mm: number }
  /** Independent planes predict better than the grating equation: laser or grating deviate from the data sheet. */
  | { kind: "free"; use: ModelName; worst_mm: number; best_mm: number }
  /** Too few poses to compare. */
  | { kind: "unknown"; use: ModelName };

/** Which light model to use, and why. */
export function recommendationOf(models: Models): Recommendation {
  const use = models.recommended;
  const bias = (model: ModelName) =>
    models.scores.find((score) => score.model === model && score.failure == null)?.held_out_bias_mm ?? undefined;
  const known = models.scores.map((score) => bias(score.model)).filter((value) => value !== undefined);
  const best_mm = bias(use);
  if (best_mm === undefined || known.length < 2) return { kind: "unknown", use };
  const worst_mm = Math.max(...known);
  if (worst_mm < ALIKE_RATIO * best_mm) return { kind: "alike", use, best_mm };
  return { kind: use === "grating" ? "curved" : "free", use, worst_mm, best_mm };
}

/** Angle of an order relative to order 0: calibrated, and nominal by the data sheet. */
export interface OrderAngle {
  order: number;
  calibrated_deg: number;
  /** `undefined` if the document does not contain the nominal value. */
  nominal_deg: number | undefined;
}

const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const DEGREES = 180 / Math.PI;

/** Angle of every order relative to order 0, by the grating equation sin θ = sin θᵢ + m·λ/d. */
export function orderAngles(document: CalibrationDocument): OrderAngle[] {
  const { light, orders } = document;
  if (light.model === "planes") return planeAngles(light);
  const sine =
    light.model === "grating" ? dot(vec3(light.axis), cross(vec3(light.groove), vec3(light.normal))) : 0;
  const angle = (order: number, ratio: number) => DEGREES * (Math.asin(sine + order * ratio) - Math.asin(sine));
  const nominal = document.report.light?.wavelength_over_period?.[2];
  return orders.map((order) => ({
    order,
    calibrated_deg: angle(order, light.wavelength_over_period),
    nominal_deg: nominal === undefined ? undefined : angle(order, nominal),
  }));
}

/** The planes model has no grating: angles between the plane normals. */
function planeAngles(light: Extract<Light, { model: "planes" }>): OrderAngle[] {
  const zero = light.planes.find((plane) => plane.order === 0)?.normal;
  if (!zero) return [];
  return light.planes.map(({ order, normal }) => {
    const cosine = Math.min(1, Math.abs(dot(vec3(zero), vec3(normal))));
    return { order, calibrated_deg: Math.sign(order) * DEGREES * Math.acos(cosine), nominal_deg: undefined };
  });
}
