/** Texts and links of a job. */

import type { Job } from "../../api/client";
import { href } from "../../state/browser/route";
import { text } from "../../text";

export function kindOf(job: Job): string {
  return text.value.jobs.kinds[job.kind] ?? job.kind;
}

/** The URL of the job's result. */
export function resultUrl(job: Job): string | undefined {
  const result = job.result;
  if (!result) return undefined;
  if (result.kind === "scan") return href("result", result.id);
  if (result.kind === "calibration") return href("calibration", undefined, { show: result.id });
  if (result.kind === "inspection") return href("inspections", result.id);
  return result.href;
}

/** Run time, s. */
export function runTime_s(job: Job): number | undefined {
  if (job.started_at_ms == null || job.ended_at_ms == null) return undefined;
  return (job.ended_at_ms - job.started_at_ms) / 1000;
}
