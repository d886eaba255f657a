/** Selects the inspection of the large verdict: never one older than the newest part. */

import type { Job } from "../../../api/client";
import type { Inspection } from "../../../state/records/inspections";
import { hasEnded, nameOf } from "../../../state/records/jobs";

export type Last =
  | { kind: "none" }
  /** A part is waiting for the station. */
  | { kind: "waiting"; serial: string | undefined }
  /** A part is being inspected, or its inspection is being read. */
  | { kind: "running"; serial: string | undefined }
  /** The newest part has no inspection: it was cancelled or failed. */
  | { kind: "without_verdict"; serial: string | undefined }
  | { kind: "inspection"; inspection: Inspection };

/** `inspections`: newest first; `newest`: the newest inspection job. */
export function lastOf(inspections: readonly Inspection[], newest: Job | undefined): Last {
  const inspection = inspections[0];
  const serial = newest && nameOf(newest);
  if (newest?.state === "queued") return { kind: "waiting", serial };
  if (newest && !hasEnded(newest)) return { kind: "running", serial };
  const is_read = inspections.some(({ job_id }) => job_id === newest?.id);
  if (newest && !is_read && (newest.ended_at_ms ?? 0) >= (inspection?.created_at_ms ?? 0)) {
    return { kind: newest.state === "succeeded" ? "running" : "without_verdict", serial };
  }
  return inspection ? { kind: "inspection", inspection } : { kind: "none" };
}

export type Stage = "queued" | "scanning" | "measuring";

export const STAGES: readonly Stage[] = ["queued", "scanning", "measuring"];

/** The stage of a waiting or running inspection. */
export function stageOf({ state, step }: Pick<Job, "state" | "step">): Stage {
  if (state === "queued") return "queued";
  const computes = ["computing_cloud", "storing_cloud", "measuring"].includes(step?.phase ?? "");
  return computes ? "measuring" : "scanning";
}
