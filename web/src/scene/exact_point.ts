/** The server's exact point for one that was picked in the picture. */

import { type Api, data, type Schemas } from "../api/client";
import type { Picked } from "./picking";
import { distance, type Vec3, vec3 } from "./shapes";

type Profile = Schemas["ProfileDto"];

/** A point as the server computed it; part frame. */
export interface ExactPoint {
  position_mm: Vec3;
  /** Standard deviation along its camera ray, from image noise. */
  sigma_mm: number;
  order: number;
  u_px: number;
  v_px: number;
  frame: number;
  stage_mm: number;
}

/** Display positions are rounded by some µm; a point farther away is another one. */
const SAME_POINT_MM = 0.03;

/** Where along its line the display puts a point: rounded to whole pixels. */
const ROUNDED_PX = 0.501;

/** Asks the server; undefined where it has no such point (yet): while the scan runs, or left out by this frame alone. */
export async function exactPoint(api: Api, scan_id: string, picked: Picked): Promise<ExactPoint | undefined> {
  const path = { id: scan_id, sequence: picked.frame };
  const answer = await api.GET("/api/v1/scans/{id}/profiles/{sequence}", { params: { path } });
  if (answer.response.status === 404) return undefined;
  const profile = await data(Promise.resolve(answer));
  return matchPoint(profile, await stageDirection(api, profile.calibration_id), picked);
}

/** The point of a profile that was picked: same order, same place along the line, same position. */
export function matchPoint(profile: Profile, direction: Vec3, picked: Picked): ExactPoint | undefined {
  let best: ExactPoint | undefined;
  let best_mm = SAME_POINT_MM;
  for (let idx = 0; idx < profile.order.length; idx++) {
    const { order = Number.NaN, u_px = Number.NaN, v_px = Number.NaN } = at(profile, idx);
    if (order !== picked.order) continue;
    const along = [u_px, v_px].some((px) => Math.abs(px - picked.along_px) <= ROUNDED_PX);
    if (!along) continue;
    const position_mm = inPart(profile, idx, direction);
    const off_mm = distance(position_mm, picked.position_mm);
    if (off_mm > best_mm) continue;
    best_mm = off_mm;
    const sigma_mm = profile.sigma_mm[idx] ?? Number.NaN;
    best = { position_mm, sigma_mm, order, u_px, v_px, frame: profile.sequence, stage_mm: profile.position_mm };
  }
  return best;
}

function at(profile: Profile, idx: number) {
  return { order: profile.order[idx], u_px: profile.u_px[idx], v_px: profile.v_px[idx] };
}

/** X_part = X_camera − s·t. */
function inPart(profile: Profile, idx: number, direction: Vec3): Vec3 {
  const s = profile.position_mm;
  const part = (values: readonly number[], axis: 0 | 1 | 2) => (values[idx] ?? Number.NaN) - s * direction[axis];
  return [part(profile.x_mm, 0), part(profile.y_mm, 1), part(profile.z_mm, 2)];
}

const directions = new Map<string, Vec3>();

/** Way of the stage per mm of a calibration; zero where it has no stage. */
async function stageDirection(api: Api, calibration_id: string): Promise<Vec3> {
  const known = directions.get(calibration_id);
  if (known) return known;
  const params = { path: { id: calibration_id } };
  const { calibration } = await data(api.GET("/api/v1/calibrations/{id}", { params }));
  const direction = vec3(calibration.stage?.direction_mm_per_mm ?? [0, 0, 0]);
  directions.set(calibration_id, direction);
  return direction;
}
