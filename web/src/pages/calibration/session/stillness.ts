/** Whether the board is still and in a new pose: the condition for auto-capture. */

import type { Corner, Detection, Session } from "./session_state";

/** Mean motion of the corners from detection to detection below which the board is still, px of the frame. */
export const STILL_PX = 0.7;

/** Time for which the board must be still, so that a hand-held board settles. */
export const STILL_FOR_MS = 1000;

/**
 * A pose is known if the mean distance of its corners from those of an earlier image is below this share of the
 * width.
 */
const NEW_POSE_FRACTION = 0.03;

/** Mean distance of the common corners, px; infinite if there are none. */
export function meanDistance(a: readonly Corner[], b: readonly Corner[]): number {
  const places = new Map(b.map(([column, row, u, v]) => [`${column},${row}`, [u, v] as const]));
  let [sum, n] = [0, 0];
  for (const [column, row, u, v] of a) {
    const other = places.get(`${column},${row}`);
    if (!other || u === undefined || v === undefined) continue;
    sum += Math.hypot(u - (other[0] ?? 0), v - (other[1] ?? 0));
    n += 1;
  }
  return n === 0 ? Number.POSITIVE_INFINITY : sum / n;
}

/** Whether there is already an image of this pose. */
export function isKnownPose(detection: Detection, session: Session): boolean {
  return session.body.poses.some((pose) => isAtPose(detection, pose.board.corners));
}

/** Whether the board is at the pose of these corners. */
export function isAtPose(detection: Detection, corners: readonly Corner[]): boolean {
  return meanDistance(detection.corners, corners) < NEW_POSE_FRACTION * detection.width_px;
}

/** Determines from successive detections how long the board has been still. */
export class Stillness {
  private last: Detection | undefined;
  private since_ms = 0;

  /** Processes the next detection; returns how long the board has been still, ms. */
  follow(detection: Detection): number {
    const moved_px = this.last ? meanDistance(detection.corners, this.last.corners) : Number.POSITIVE_INFINITY;
    if (detection.corners.length === 0 || moved_px > STILL_PX) this.since_ms = detection.captured_ms;
    this.last = detection;
    return detection.captured_ms - this.since_ms;
  }

  reset(): void {
    this.last = undefined;
  }
}
