/** What the comparison of the three light models means, and the angles of the orders against the grating equation. */

import { dot, type Vec3, vec3 } from "../../../scene/cloud/shapes";
import type { CalibrationDocument, Light, ModelName, Models } from "./summary";

/** Below this ratio the errors of two models are indistinguishable with a dozen poses. */
const ALIKE_RATIO = 1.5;

export type Recommendation =
  /** Flat models miss the bend of the sheets. */
  | { kind: "curved"; use: ModelName; worst_mm: number; best_mm: number }
  /** All models predict alike: the simplest is enough. */
  | { kind: "alike"; use: ModelName; best_mm: number }
  /** Free planes do better than what physics predicts: grating or laser are not what the data sheet says. */
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

/** An order's angle from order 0: as calibrated, and as the data sheet's grating would send it. */
export interface OrderAngle {
  order: number;
  calibrated_deg: number;
  /** `undefined`: the data sheet's value is not in the document. */
  nominal_deg: number | undefined;
}

const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const DEGREES = 180 / Math.PI;

/** Angle of every order from order 0, by the grating equation sin θ = sin θᵢ + m·λ/d. */
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

/** Free planes have no grating: the angles between their normals. */
function planeAngles(light: Extract<Light, { model: "planes" }>): OrderAngle[] {
  const zero = light.planes.find((plane) => plane.order === 0)?.normal;
  if (!zero) return [];
  return light.planes.map(({ order, normal }) => {
    const cosine = Math.min(1, Math.abs(dot(vec3(zero), vec3(normal))));
    return { order, calibrated_deg: Math.sign(order) * DEGREES * Math.acos(cosine), nominal_deg: undefined };
  });
}
