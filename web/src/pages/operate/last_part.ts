/** Which part the last result is about: never an earlier one than the newest scan that was started. */

import type { Job } from "../../api/client";
import { hasEnded, nameOf } from "../../state/records/jobs";
import type { ScannedPart } from "../../state/records/scanned";

export type Last =
  | { kind: "none" }
  /** A scan waits or runs, or its part is about to be read. */
  | { kind: "running"; name: string | undefined }
  /** The newest scan ended without a part. */
  | { kind: "without_part" }
  | { kind: "part"; part: ScannedPart };

/** `parts`: newest first; `newest`: the newest scan job. */
export function lastOf(parts: readonly ScannedPart[] | undefined, newest: Job | undefined): Last {
  const part = parts?.[0];
  if (newest && !hasEnded(newest)) return { kind: "running", name: nameOf(newest) };
  // A part that was made later by another way, such as computing again, is newer than the scan.
  const earlier =
    newest && part?.scan.job_id !== newest.id && (part?.scan.created_at_ms ?? 0) < newest.created_at_ms;
  if (earlier && parts) return { kind: "without_part" };
  return part ? { kind: "part", part } : { kind: "none" };
}
