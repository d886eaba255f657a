/** Severity of a card. `caution`: needs attention soon; `alarm`: not working now. */

import type { Schemas, Station } from "../../api/client";
import type { DropCount } from "../../stream/text_messages";

export type Tone = "calm" | "caution" | "alarm";

/** Below this a long scan with kept frames may not fit. */
const LOW_DISK_BYTES = 5e9;
/** Here the server soon refuses jobs. */
const FULL_DISK_BYTES = 5e8;
/** Share of messages that a viewer could not take in time. */
const SLOW_VIEWER_SHARE = 0.2;
/** Link times above this are felt at Stop. */
const SLOW_LINK_MS = 250;
/** Jobs waiting; the server refuses more than 32. */
const LONG_QUEUE = 24;
/** A calibration is looked at again after so long. */
const OLD_CALIBRATION_DAYS = 30;

export function deviceTone(connected: boolean, faults: Station["faults"], device: string): Tone {
  return !connected || faults.some((fault) => fault.device === device) ? "alarm" : "calm";
}

/** Losses inside of the service are its own; those at the camera happen when its trigger changes, too. */
export function framesTone(frames: Schemas["FrameCountsDto"]): Tone {
  const { camera: at_camera = 0, ...inside } = frames.dropped;
  if (Object.values(inside).some((count) => count > 0)) return "caution";
  return at_camera > 0.05 * Math.max(frames.arrived, 100) ? "caution" : "calm";
}

export function linkTone(stale: boolean, round_trip_ms: number | undefined, dropped: readonly DropCount[]): Tone {
  if (stale) return "alarm";
  const slow = dropped.some(({ offered, too_slow }) => offered > 100 && too_slow > SLOW_VIEWER_SHARE * offered);
  return slow || (round_trip_ms ?? 0) > SLOW_LINK_MS ? "caution" : "calm";
}

export function diskTone(free_bytes: number | undefined, read_only: boolean): Tone {
  if (read_only || (free_bytes !== undefined && free_bytes < FULL_DISK_BYTES)) return "alarm";
  return free_bytes !== undefined && free_bytes < LOW_DISK_BYTES ? "caution" : "calm";
}

export function queueTone(n_queued: number): Tone {
  return n_queued >= LONG_QUEUE ? "caution" : "calm";
}

/** Whole days since a time. */
export function ageDays(at_ms: number, now_ms: number): number {
  return Math.max(0, Math.floor((now_ms - at_ms) / 86_400_000));
}

export function calibrationTone(made_at_ms: number | undefined, now_ms: number): Tone {
  if (made_at_ms === undefined) return "caution";
  return ageDays(made_at_ms, now_ms) > OLD_CALIBRATION_DAYS ? "caution" : "calm";
}

/** The orders disagree when their mean distance is more than 3 standard deviations of the calibration. */
export function pairDisagrees(
  pair: Schemas["OrderPairDto"],
  systematic_sigma_mm: number | null | undefined,
): boolean {
  return systematic_sigma_mm != null && Math.abs(pair.bias_mm) > 3 * systematic_sigma_mm;
}
