/** Selects the part of the last result: never one older than the newest scan. */

import type { Job } from "../../api/client";
import { hasEnded, nameOf } from "../../state/records/jobs";
import type { ScannedPart } from "../../state/records/scanned";

export type Last =
  | { kind: "none" }
  /** A scan is waiting or running. */
  | { kind: "running"; name: string | undefined }
  /** The newest scan ended without a part. */
  | { kind: "without_part" }
  | { kind: "part"; part: ScannedPart };

/** `parts`: newest first; `newest`: the newest scan job. */
export function lastOf(parts: readonly ScannedPart[] | undefined, newest: Job | undefined): Last {
  const part = parts?.[0];
  if (newest && !hasEnded(newest)) return { kind: "running", name: nameOf(newest) };
  // A result created later in another way, such as a recomputation, is newer than the scan.
  const earlier =
    newest && part?.scan.job_id !== newest.id && (part?.scan.created_at_ms ?? 0) < newest.created_at_ms;
  if (earlier && parts) return { kind: "without_part" };
  return part ? { kind: "part", part } : { kind: "none" };
}
