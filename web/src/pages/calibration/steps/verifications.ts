/** Verifications of a calibration on reference parts, found in the list of jobs. */

import type { Job, Schemas } from "../../../api/client";

export interface Verification {
  job: Job;
  reference_part: string;
  nominal_mm: number;
  tolerance_mm: number | undefined;
}

/** Whether the newest verification is OK. `verifications`: newest first; `scans`: those of the verifications. */
export function isVerified(
  verifications: readonly Verification[],
  scans: readonly Pick<Schemas["ScanDto"], "job_id" | "verdict">[],
): boolean {
  const newest = verifications[0]?.job;
  return newest?.state === "succeeded" && scans.find((scan) => scan.job_id === newest.id)?.verdict === "ok";
}

/** The verifications of a calibration among `jobs`, newest first. */
export function verificationsOf(jobs: readonly Job[], calibration_id: string): Verification[] {
  return jobs.flatMap((job) => {
    if (job.input?.kind !== "verification") return [];
    const { reference_part, nominal_mm, tolerance_mm, scan } = job.input;
    if (scan.calibration_id !== calibration_id) return [];
    return [{ job, reference_part, nominal_mm, tolerance_mm: tolerance_mm ?? undefined }];
  });
}

/** Scan and measurement of a verification. */
export function measurementOf(job: Job): { scan_id: string; measurement_id: string } | undefined {
  const [scan_id, measurement_id] = job.result?.id.split("/") ?? [];
  return scan_id && measurement_id ? { scan_id, measurement_id } : undefined;
}
