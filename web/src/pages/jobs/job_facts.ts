/** Texts and links of a job. */

import type { Job } from "../../api/client";
import { href } from "../../state/browser/route";
import { text } from "../../text";

export function kindOf(job: Job): string {
  return text.value.jobs.kinds[job.kind] ?? job.kind;
}

/** The URL of the job's result. */
export function madeAt(job: Job): string | undefined {
  const made = job.result;
  if (!made) return undefined;
  if (made.kind === "scan") return href("result", made.id);
  if (made.kind === "calibration") return href("calibration", undefined, { show: made.id });
  if (made.kind === "inspection") return href("inspections", made.id);
  return made.href;
}

/** Run time, s. */
export function ranFor_s(job: Job): number | undefined {
  if (job.started_at_ms == null || job.ended_at_ms == null) return undefined;
  return (job.ended_at_ms - job.started_at_ms) / 1000;
}
