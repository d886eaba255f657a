/** Finds the server's exact point for a picked point. */

import { type Api, data, type Schemas } from "../../api/client";
import type { Picked } from "./picking";
import { distance, type Vec3, vec3 } from "./shapes";

type Profile = Schemas["ProfileDto"];

/** A point with exact values from the server; part frame. */
export interface ExactPoint {
  position_mm: Vec3;
  /** Standard deviation along the camera ray, from image noise. */
  sigma_mm: number;
  order: number;
  u_px: number;
  v_px: number;
  frame: number;
  /** Stage position; on a turntable its angle, degrees. */
  stage_mm: number;
}

/** The axis of a turntable: a point on it, mm, and its unit vector; camera frame. */
export interface TurnAxis {
  point_mm: Vec3;
  direction: Vec3;
}

/** Display positions are rounded by a few µm; a point farther away is a different one. */
const SAME_POINT_MM = 0.03;

/** Tolerance of the position along the line, which is rounded to whole pixels for display. */
const ROUNDED_PX = 0.501;

/**
 * Requests the exact point; undefined if the server does not have it: during the scan, or if this frame alone
 * rejected it.
 */
export async function exactPoint(api: Api, scan_id: string, picked: Picked): Promise<ExactPoint | undefined> {
  const path = { id: scan_id, sequence: picked.frame };
  const answer = await api.GET("/api/v1/scans/{id}/profiles/{sequence}", { params: { path } });
  if (answer.response.status === 404) return undefined;
  const profile = await data(Promise.resolve(answer));
  return matchPoint(profile, await stageOf(api, profile.calibration_id), picked);
}

/** Finds the picked point in a profile, by order, position along the line, and position in space. */
export function matchPoint(profile: Profile, stage: Vec3 | TurnAxis, picked: Picked): ExactPoint | undefined {
  let best: ExactPoint | undefined;
  let best_mm = SAME_POINT_MM;
  for (let idx = 0; idx < profile.order.length; idx++) {
    const { order = Number.NaN, u_px = Number.NaN, v_px = Number.NaN } = at(profile, idx);
    if (order !== picked.order) continue;
    const along = [u_px, v_px].some((px) => Math.abs(px - picked.along_px) <= ROUNDED_PX);
    if (!along) continue;
    const position_mm = inPart(profile, idx, stage);
    const off_mm = distance(position_mm, picked.position_mm);
    if (off_mm > best_mm) continue;
    best_mm = off_mm;
    const sigma_mm = profile.sigma_mm[idx] ?? Number.NaN;
    const stage_mm = profile.position_mm ?? profile.angle_deg ?? Number.NaN;
    best = { position_mm, sigma_mm, order, u_px, v_px, frame: profile.sequence, stage_mm };
  }
  return best;
}

function at(profile: Profile, idx: number) {
  return { order: profile.order[idx], u_px: profile.u_px[idx], v_px: profile.v_px[idx] };
}

/** X_part = X_camera − s·t; on a turntable X_part = c + R(a, −θ)·(X_camera − c). */
function inPart(profile: Profile, idx: number, stage: Vec3 | TurnAxis): Vec3 {
  const camera = vec3([profile.x_mm, profile.y_mm, profile.z_mm].map((values) => values[idx] ?? Number.NaN));
  if ("point_mm" in stage) return turnedBack(camera, stage, ((profile.angle_deg ?? 0) * Math.PI) / 180);
  const s = profile.position_mm ?? 0;
  return [camera[0] - s * stage[0], camera[1] - s * stage[1], camera[2] - s * stage[2]];
}

/** By Rodrigues' formula. */
function turnedBack(at: Vec3, { point_mm: c, direction: a }: TurnAxis, angle_rad: number): Vec3 {
  const v: Vec3 = [at[0] - c[0], at[1] - c[1], at[2] - c[2]];
  const across: Vec3 = [a[1] * v[2] - a[2] * v[1], a[2] * v[0] - a[0] * v[2], a[0] * v[1] - a[1] * v[0]];
  const along = a[0] * v[0] + a[1] * v[1] + a[2] * v[2];
  const [cos, sin] = [Math.cos(angle_rad), -Math.sin(angle_rad)];
  const part = (i: 0 | 1 | 2) => c[i] + v[i] * cos + across[i] * sin + a[i] * along * (1 - cos);
  return [part(0), part(1), part(2)];
}

const stages = new Map<string, Vec3 | TurnAxis>();

/** Displacement per mm of travel by a calibration, zero without a stage; or the axis of its turntable. */
async function stageOf(api: Api, calibration_id: string): Promise<Vec3 | TurnAxis> {
  const known = stages.get(calibration_id);
  if (known) return known;
  const params = { path: { id: calibration_id } };
  const { calibration } = await data(api.GET("/api/v1/calibrations/{id}", { params }));
  const found = calibration.stage;
  const stage =
    found && "kind" in found
      ? { point_mm: vec3(found.point_mm), direction: vec3(found.direction) }
      : vec3(found?.direction_mm_per_mm ?? [0, 0, 0]);
  stages.set(calibration_id, stage);
  return stage;
}
