/** The progress of a calibration session, derived from the session alone, so that all browsers agree. */

import type { Job, Schemas } from "../../../api/client";
import { hasEnded } from "../../../state/records/jobs";

export type Session = Schemas["SessionDto"];
export type Detection = Schemas["BoardDetectionDto"];
export type Corner = Detection["corners"][number];

export const STEPS = ["check", "camera", "light", "stage", "verify", "finish"] as const;
export type Step = (typeof STEPS)[number];

/** Columns and rows of the coverage map, as defined by the server. */
export const COVERAGE = { columns: 8, rows: 6 } as const;

/** Minimum number of images with a detected board that the server accepts. */
export const FEWEST_BOARDS = 3;

export type Requirement = Schemas["RequirementDto"];

export interface Requirements {
  boards: Requirement;
  cells: Requirement;
  tilt: Requirement & { wanted_deg: number; values_deg: readonly number[] };
  distance: Requirement & { values_mm: readonly number[] };
  /** Whether all requirements of the camera are met. */
  all: boolean;
}

/** The requirements of the session from the server, with the values to display. */
export function requirementsOf({ needs, body }: Session): Requirements {
  const boards = body.poses.map((pose) => pose.board).filter((board) => board.corners.length > 0);
  const values_deg = boards.map((board) => board.tilt_deg ?? undefined).filter((value) => value !== undefined);
  const values_mm = boards.map((board) => board.distance_mm ?? undefined).filter((value) => value !== undefined);
  return {
    boards: needs.boards,
    cells: needs.cells,
    tilt: { ...needs.tilted_boards, wanted_deg: needs.tilted_deg, values_deg },
    distance: { ...needs.distance_mm, values_mm },
    all: needs.camera_met,
  };
}

/** Number of images with a detected board. */
export function readableBoards(session: Session): number {
  return session.body.poses.filter((pose) => pose.board.corners.length > 0).length;
}

/** Cells covered by any board of the session. */
export function coveredCells(session: Session): ReadonlySet<number> {
  return new Set(session.body.poses.flatMap((pose) => pose.board.coverage_cells));
}

/** The calibration created by the session's job. */
export function calibrationOf(job: Job | undefined): string | undefined {
  return job?.state === "succeeded" ? (job.result?.id ?? undefined) : undefined;
}

/** The current step of the session. `verified`: whether the newest verification is OK. */
export function stepOf(session: Session | undefined, job: Job | undefined, verified: boolean): Step {
  if (!session) return "check";
  if (calibrationOf(job) !== undefined) return verified ? "finish" : "verify";
  if (job && !hasEnded(job)) return "stage";
  if (session.body.stage_views.length > 0 || job) return "stage";
  return requirementsOf(session).all ? "light" : "camera";
}

/** Whether a step is done. */
export function isDone(
  step: Step,
  session: Session | undefined,
  job: Job | undefined,
  verified: boolean,
): boolean {
  if (!session) return false;
  const solved = calibrationOf(job) !== undefined;
  switch (step) {
    case "check":
      return true;
    case "camera":
      return solved || requirementsOf(session).all;
    case "light":
      return solved || (session.needs?.laser_boards.met ?? false);
    case "stage":
      return solved || (session.needs?.stage_views.met ?? false);
    case "verify":
      return verified;
    case "finish":
      return false;
  }
}
