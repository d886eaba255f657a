/** Severity of a card. `caution`: needs attention soon; `alarm`: not working now. */

import type { Schemas, Station } from "../../api/client";
import type { Door } from "../../state/records/doors";
import type { DropCount } from "../../stream/text_messages";

export type Tone = "calm" | "caution" | "alarm";

/** Caution level: below this a long scan with saved images may not fit. */
const LOW_DISK_BYTES = 5e9;
/** Alarm level: close to the limit at which the server refuses jobs. */
const FULL_DISK_BYTES = 5e8;
/** Caution level of the share of messages dropped because the connection is slow. */
const SLOW_VIEWER_FRACTION = 0.2;
/** Caution level of the round-trip time: above this, Stop is noticeably delayed. */
const SLOW_LINK_MS = 250;
/** Caution level of waiting jobs; the server refuses more than 32. */
const LONG_QUEUE = 24;
/** Age at which a calibration should be verified, days. */
const OLD_CALIBRATION_DAYS = 30;

export function deviceTone(connected: boolean, faults: Station["faults"], device: string): Tone {
  return !connected || faults.some((fault) => fault.device === device) ? "alarm" : "calm";
}

/** Any loss inside the service is a caution; a few at the camera are normal when its trigger changes. */
export function framesTone(frames: Schemas["FrameCountsDto"]): Tone {
  const { camera: at_camera = 0, ...inside } = frames.dropped;
  if (Object.values(inside).some((count) => count > 0)) return "caution";
  return at_camera > 0.05 * Math.max(frames.arrived, 100) ? "caution" : "calm";
}

export function linkTone(stale: boolean, round_trip_ms: number | undefined, dropped: readonly DropCount[]): Tone {
  if (stale) return "alarm";
  const slow = dropped.some(({ offered, too_slow }) => offered > 100 && too_slow > SLOW_VIEWER_FRACTION * offered);
  return slow || (round_trip_ms ?? 0) > SLOW_LINK_MS ? "caution" : "calm";
}

export function diskTone(free_bytes: number | undefined, read_only: boolean): Tone {
  if (read_only || (free_bytes !== undefined && free_bytes < FULL_DISK_BYTES)) return "alarm";
  return free_bytes !== undefined && free_bytes < LOW_DISK_BYTES ? "caution" : "calm";
}

/** A waiting door retries automatically; a closed one delivers nothing until a user acts. */
export function doorTone({ state, n_dead }: Pick<Door, "state" | "n_dead">): Tone {
  if (state === "closed") return "alarm";
  return state === "waiting" || n_dead > 0 ? "caution" : "calm";
}

export function worstTone(tones: readonly Tone[]): Tone {
  return tones.includes("alarm") ? "alarm" : tones.includes("caution") ? "caution" : "calm";
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

/** Whether the mean difference of two orders exceeds 3 standard deviations of the calibration. */
export function pairDisagrees(
  pair: Schemas["OrderPairDto"],
  systematic_sigma_mm: number | null | undefined,
): boolean {
  return systematic_sigma_mm != null && Math.abs(pair.bias_mm) > 3 * systematic_sigma_mm;
}
