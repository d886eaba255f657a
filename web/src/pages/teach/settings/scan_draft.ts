/** How a recipe scans, while it is edited. */

import type { Schemas } from "../../../api/client";
import { exposuresUpTo, FIRST_LONGEST_US, type Mode } from "../../scan/acquisition";

type ScanSettings = Schemas["ScanSettingsDto"];

export const STAGES = ["linear", "rotary"] as const;
export type Stage = (typeof STAGES)[number];

/** A ratio of successive exposures below this is refused by the server. */
const LEAST_EXPOSURE_RATIO = 1.5;

/** A number that is `undefined` is not given. */
export interface ScanDraft {
  stage: Stage;
  /** mm or degrees, according to the stage; speed per second. */
  from: number | undefined;
  to: number | undefined;
  step: number | undefined;
  speed: number | undefined;
  /** `undefined`: continuous if there is a speed. */
  mode: Mode | undefined;
  /** A single exposure, `undefined` if the station chooses it, or all exposures of a row. */
  exposures_us: readonly (number | undefined)[];
  /** Fraction of full power. */
  laser_power: number | undefined;
  /** Ambient light subtraction; `undefined`: none. */
  background: Schemas["BackgroundDto"] | undefined;
  keep_frames: boolean;
  record: boolean;
}

/** Why a recipe cannot scan like this. */
export type ScanFault =
  | "no_range"
  | "no_step"
  | "no_pace"
  | "no_travel"
  | "exposure_missing"
  | "exposures_continuous"
  | "exposures_ambient"
  | "exposures_images"
  | "exposures_similar";

/** The settings of a recipe. */
export function draftOf(scan: ScanSettings): ScanDraft {
  const { from_mm, to_mm, step_mm, speed_mm_s, from_deg, to_deg, step_deg, speed_deg_s } = scan;
  const { mode, exposure_us, exposures_us, laser_power, background, keep_frames, record } = scan;
  const is_rotary = [from_deg, to_deg, step_deg, speed_deg_s].some((value) => value != null);
  return {
    stage: is_rotary ? "rotary" : "linear",
    from: (is_rotary ? from_deg : from_mm) ?? undefined,
    to: (is_rotary ? to_deg : to_mm) ?? undefined,
    step: (is_rotary ? step_deg : step_mm) ?? undefined,
    speed: (is_rotary ? speed_deg_s : speed_mm_s) ?? undefined,
    mode: mode ?? undefined,
    exposures_us: exposures_us && exposures_us.length > 1 ? exposures_us : [exposure_us ?? undefined],
    laser_power: laser_power ?? undefined,
    background: background ?? undefined,
    keep_frames: keep_frames ?? false,
    record: record ?? false,
  };
}

/** The settings of a recipe that scans as this scan did; images are not saved. */
export function draftOfRun(run: Schemas["ScanRunDto"]): ScanDraft {
  const { keep_frames: _keep_frames, ...settings } = run;
  const draft = draftOf(settings);
  // The row spacing of a continuous scan follows from speed and frame rate.
  return modeOf(draft) === "continuous" ? { ...draft, step: undefined } : draft;
}

/** The settings as they are published; what is not given is absent. */
export function settingsOf(draft: ScanDraft): ScanSettings {
  const { mode, laser_power, background, keep_frames, record } = draft;
  return {
    ...(draft.stage === "linear" ? travelOf(draft) : turnOf(draft)),
    ...(mode !== undefined && { mode }),
    ...exposuresOf(draft),
    ...(laser_power !== undefined && { laser_power }),
    ...(background !== undefined && { background }),
    ...(keep_frames && { keep_frames }),
    ...(record && { record }),
  };
}

function travelOf(draft: ScanDraft): ScanSettings {
  const { from, to, step, speed } = paced(draft);
  return {
    ...(from !== undefined && { from_mm: from }),
    ...(to !== undefined && { to_mm: to }),
    ...(step !== undefined && { step_mm: step }),
    ...(speed !== undefined && { speed_mm_s: speed }),
  };
}

function turnOf(draft: ScanDraft): ScanSettings {
  const { from, to, step, speed } = paced(draft);
  return {
    ...(from !== undefined && { from_deg: from }),
    ...(to !== undefined && { to_deg: to }),
    ...(step !== undefined && { step_deg: step }),
    ...(speed !== undefined && { speed_deg_s: speed }),
  };
}

/** Without a speed if the scan stops for every row. */
function paced(draft: ScanDraft): ScanDraft {
  return modeOf(draft) === "continuous" ? draft : { ...draft, speed: undefined };
}

function exposuresOf({ exposures_us }: ScanDraft): ScanSettings {
  const given_us = exposures_us.filter((us) => us !== undefined);
  if (exposures_us.length > 1) return { exposures_us: given_us };
  const [exposure_us] = given_us;
  return exposure_us === undefined ? {} : { exposure_us };
}

/** The motion, given or implied. */
export function modeOf({ mode, speed }: Pick<ScanDraft, "mode" | "speed">): Mode {
  return mode ?? (speed === undefined ? "stop_and_go" : "continuous");
}

/** With another kind of stage: positions of the former mean nothing on it. */
export function withStage(draft: ScanDraft, stage: Stage): ScanDraft {
  if (stage === draft.stage) return draft;
  return {
    ...draft,
    stage,
    from: undefined,
    to: undefined,
    step: undefined,
    speed: undefined,
    mode: modeOf(draft),
  };
}

/** With `n` exposures per row; the longest stays. */
export function withExposures(draft: ScanDraft, n: number): ScanDraft {
  const given_us = draft.exposures_us.filter((us) => us !== undefined);
  const longest_us = given_us.length > 0 ? Math.max(...given_us) : undefined;
  const exposures_us = n > 1 ? exposuresUpTo(longest_us ?? FIRST_LONGEST_US, n) : [longest_us];
  return { ...draft, exposures_us };
}

/** What the server would refuse, as far as it does not depend on the station. */
export function scanFault(draft: ScanDraft): ScanFault | undefined {
  const { from, to, step, speed } = draft;
  if (from === undefined || to === undefined) return "no_range";
  if (modeOf(draft) === "continuous") {
    if (step === undefined && speed === undefined) return "no_pace";
    if (from === to) return "no_travel";
  } else if (step === undefined) return "no_step";
  return draft.exposures_us.length > 1 ? exposuresFault(draft) : undefined;
}

function exposuresFault(draft: ScanDraft): ScanFault | undefined {
  const given_us = draft.exposures_us.filter((us) => us !== undefined).sort((a, b) => a - b);
  if (given_us.length < draft.exposures_us.length) return "exposure_missing";
  if (modeOf(draft) === "continuous") return "exposures_continuous";
  if (draft.background) return "exposures_ambient";
  if (draft.keep_frames || draft.record) return "exposures_images";
  const is_similar = given_us.some((us, idx) => us < LEAST_EXPOSURE_RATIO * (given_us[idx - 1] ?? 0));
  return is_similar ? "exposures_similar" : undefined;
}
