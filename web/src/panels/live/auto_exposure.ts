/** Finds an exposure at which the laser lines are bright and not flattened, from the histograms of live frames. */

import { effect } from "@preact/signals";
import { type Problem, Refusal } from "../../api/client";
import { text } from "../../text";
import type { Advice } from "./advice";
import type { CameraSettings } from "./camera_settings";
import type { Figures, LiveView } from "./live_view";

/** Where the brightest pixels shall be, as share of full scale: room for a brighter spot of the part. */
const BRIGHT = 0.6;

/** Largest step to longer exposures: noise is no measure of light. */
const LONGEST_STEP = 4;

/** Halving from the longest exposure of a camera to its shortest takes about as many steps. */
const STEPS = 14;

/** A frame with the new exposure comes at latest after so long. */
const FRAME_WITHIN_MS = 10_000;

/** The camera rounds what is asked for. */
const SAME_EXPOSURE = 0.02;

/** By how much the exposure should change; `undefined` where it is right. `shortened`: it was too long before. */
export function exposureFactor({ kind, bright }: Advice, shortened: boolean): number | undefined {
  if (kind === "over") return 0.5;
  // What was too long and is now too short has highlights that no exposure suits; the lines count.
  if (kind === "good" || shortened) return undefined;
  return Math.min(LONGEST_STEP, BRIGHT / Math.max(bright, 0.01));
}

/** Sets the exposure step by step while the live view runs with light. */
export async function autoExposure(
  view: LiveView,
  settings: CameraSettings,
  limits: { min: number; max: number },
): Promise<void> {
  let shortened = false;
  for (let step = 0; step < STEPS; step++) {
    const exposure_us = settings.draft.peek().exposure_us ?? limits.min;
    const { advice } = await frameWith(view, exposure_us);
    const factor: number | undefined = advice && exposureFactor(advice, shortened);
    if (factor === undefined) return;
    const next_us = Math.round(Math.min(limits.max, Math.max(limits.min, factor * exposure_us)));
    if (next_us === exposure_us) return;
    shortened ||= factor < 1;
    await settings.expose(next_us);
  }
}

/** Figures of a frame that was exposed so long. */
async function frameWith(view: LiveView, exposure_us: number): Promise<Figures> {
  const first = view.figures.peek()?.sequence ?? -1;
  return await new Promise((found, failed) => {
    const timer = setTimeout(() => {
      end();
      failed(new Refusal(noFrame()));
    }, FRAME_WITHIN_MS);
    const end = effect(() => {
      const figures = view.figures.value;
      // A frame between two pulses of light says nothing of the exposure.
      if (!figures?.laser_shone || figures.sequence === first) return;
      const off = Math.abs(figures.exposure_us - exposure_us) > SAME_EXPOSURE * exposure_us;
      // A recording does not tell its exposure.
      if (off && figures.exposure_us > 0) return;
      clearTimeout(timer);
      queueMicrotask(() => end());
      found(figures);
    });
  });
}

function noFrame(): Problem {
  const { auto_no_frame, auto_no_frame_remedy } = text.value.live;
  return {
    type: "urn:sheaf:problem:page",
    title: text.value.live.auto_exposure,
    status: 0,
    detail: auto_no_frame,
    remedy: auto_no_frame_remedy,
  };
}
