/** Whether the board is still and in a new pose: the condition for auto-capture. */

import type { Corner, Look, Session } from "./session_state";

/** Mean motion of the corners from look to look below which the board is still, px of the frame. */
export const STILL_PX = 0.7;

/** Time for which the board must be still, so that a hand-held board settles. */
export const STILL_FOR_MS = 1000;

/** A board whose corners are nearer than this to those of an image taken before shows nothing new; share of width. */
const NEW_PLACE_SHARE = 0.03;

/** Mean distance of corners that both have, px; infinite if they have none in common. */
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

/** Whether an image was taken of the board in this place already. */
export function isKnownPlace(look: Look, session: Session): boolean {
  return session.body.poses.some((pose) => isThere(look, pose.board.corners));
}

/** Whether the board is where these corners were. */
export function isThere(look: Look, corners: readonly Corner[]): boolean {
  return meanDistance(look.corners, corners) < NEW_PLACE_SHARE * look.width_px;
}

/** Follows detections and returns how long the board has been still. */
export class Stillness {
  private last: Look | undefined;
  private since_ms = 0;

  /** Takes the next look; answers for how long the board has been still, ms. */
  follow(look: Look): number {
    const moved_px = this.last ? meanDistance(look.corners, this.last.corners) : Number.POSITIVE_INFINITY;
    if (look.corners.length === 0 || moved_px > STILL_PX) this.since_ms = look.captured_ms;
    this.last = look;
    return look.captured_ms - this.since_ms;
  }

  reset(): void {
    this.last = undefined;
  }
}
