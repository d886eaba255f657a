/** Determines why a scan cannot start now. */

import type { Station } from "../../api/client";
import type { PageName } from "../../state/browser/route";

export type Obstacle =
  | "no_link"
  | "no_devices"
  | "halted"
  | "fault"
  | "busy"
  | "interlock_open"
  | "not_calibrated"
  | "not_homed";

/** The page on which an obstacle can be removed; the others are removed on this page. */
export const REMEDY_PAGE: Partial<Record<Obstacle, PageName>> = {
  no_devices: "health",
  busy: "jobs",
  not_calibrated: "calibration",
};

interface Situation {
  stale: boolean;
  status: Station | undefined;
  /** Undefined: not known yet. */
  calibrated: boolean | undefined;
  /** A job is waiting for the station or using it. */
  busy: boolean;
}

export function obstacleOf({ stale, status, calibrated, busy }: Situation): Obstacle | undefined {
  if (stale || !status) return "no_link";
  if (status.state === "Halted") return "halted";
  if (status.state === "Error") return "fault";
  if (status.state === "Preoperational") return "no_devices";
  if (busy || status.job_id != null) return "busy";
  if (status.laser.interlock_closed === false) return "interlock_open";
  if (calibrated === false) return "not_calibrated";
  if (status.stage.needs_homing && !status.stage.homed) return "not_homed";
  return undefined;
}
