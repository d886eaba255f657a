/** Where a calibration session stands: everything here is read from the session itself, so all browsers agree. */

import type { Job, Schemas } from "../../api/client";
import { hasEnded } from "../../state/jobs";

export type Session = Schemas["Session"];
export type Look = Schemas["Look"];
export type Corner = Look["corners"][number];

export const STEPS = ["check", "camera", "light", "stage", "verify", "finish"] as const;
export type Step = (typeof STEPS)[number];

/** Columns and rows of the coverage map, as the server counts its cells. */
export const COVERAGE = { columns: 8, rows: 6 } as const;

/** Fewest readable boards that the server takes. */
export const FEWEST_BOARDS = 3;

/** What a good calibration has. With these the twin's calibrations stay below their own σ. */
const WANTED = {
  boards: 8,
  /** Cells of 48: the distortion is extrapolated in the others. */
  cells: 36,
  /** Boards tilted enough to tell the focal length from the distance. */
  tilted_boards: 3,
  tilted_deg: 15,
  /** Range of distances as a share of their mean: depth is calibrated where boards were. */
  distance_spread: 0.1,
} as const;

export interface Need {
  have: number;
  want: number;
  met: boolean;
}

export interface Needs {
  boards: Need;
  cells: Need;
  tilt: Need & { wanted_deg: number; values_deg: readonly number[] };
  distance: Need & { values_mm: readonly number[] };
  /** Whether nothing is missing. */
  all: boolean;
}

const need = (have: number, want: number): Need => ({ have, want, met: have >= want });

/** What the session's boards have, and what a good calibration wants. */
export function needsOf(session: Session): Needs {
  const { poses, camera } = session.body;
  const boards = poses.map((pose) => pose.board).filter((board) => board.corners.length > 0);
  const tilts = boards.map((board) => board.tilt_deg ?? undefined).filter((value) => value !== undefined);
  const distances = boards.map((board) => board.distance_mm ?? undefined).filter((value) => value !== undefined);
  const mean_mm = distances.reduce((sum, value) => sum + value, 0) / Math.max(1, distances.length);
  const spread_mm = distances.length > 1 ? Math.max(...distances) - Math.min(...distances) : 0;
  const n_cells = COVERAGE.columns * COVERAGE.rows;
  const n_covered = boards.length === 0 ? 0 : n_cells - camera.uncovered_cells.length;
  const n_tilted = tilts.filter((tilt) => tilt >= WANTED.tilted_deg).length;
  const needs = {
    boards: need(boards.length, WANTED.boards),
    cells: need(n_covered, WANTED.cells),
    tilt: { ...need(n_tilted, WANTED.tilted_boards), wanted_deg: WANTED.tilted_deg, values_deg: tilts },
    distance: {
      have: spread_mm,
      want: WANTED.distance_spread * mean_mm,
      met: distances.length > 1 && spread_mm >= WANTED.distance_spread * mean_mm,
      values_mm: distances,
    },
  };
  return { ...needs, all: Object.values(needs).every((one) => one.met) };
}

/** Readable boards at rest. */
export function readableBoards(session: Session): number {
  return session.body.poses.filter((pose) => pose.board.corners.length > 0).length;
}

/** Cells that any board of the session covers. */
export function coveredCells(session: Session): ReadonlySet<number> {
  return new Set(session.body.poses.flatMap((pose) => pose.board.coverage_cells));
}

/** The calibration that the session's job made. */
export function madeBy(job: Job | undefined): string | undefined {
  return job?.state === "succeeded" ? (job.result?.id ?? undefined) : undefined;
}

/** Where the session stands: the step that has work to do. `verified`: whether a known part was measured with it. */
export function stepOf(session: Session | undefined, job: Job | undefined, verified: boolean): Step {
  if (!session) return "check";
  if (madeBy(job) !== undefined) return verified ? "finish" : "verify";
  if (job && !hasEnded(job)) return "stage";
  if (session.body.stage_views.length > 0 || job) return "stage";
  return needsOf(session).all ? "light" : "camera";
}

/** What a step's place in the list says. */
export function isDone(
  step: Step,
  session: Session | undefined,
  job: Job | undefined,
  verified: boolean,
): boolean {
  if (!session) return false;
  const solved = madeBy(job) !== undefined;
  switch (step) {
    case "check":
      return true;
    case "camera":
      return solved || needsOf(session).all;
    case "light":
      return solved || session.body.poses.filter((pose) => pose.laser?.n_segments).length >= FEWEST_BOARDS;
    case "stage":
      return solved || session.body.stage_views.length > 1;
    case "verify":
      return verified;
    case "finish":
      return false;
  }
}
