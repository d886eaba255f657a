/** The scan settings of the form, and their request body. */

import { computed, type ReadonlySignal, signal } from "@preact/signals";
import type { Schemas } from "../../api/client";
import { remembered } from "../../state/browser/remembered";
import { exposuresUpTo, FIRST_LONGEST_US, MODES, type Mode } from "./acquisition";

export type StartScan = Schemas["StartScanDto"];

const from_mm = remembered("scan_from_mm", -20);
const to_mm = remembered("scan_to_mm", 20);
const step_mm = remembered("scan_step_mm", 0.2);
const mode = remembered<Mode>("scan_mode", "stop_and_go", MODES);
const speed_mm_s = remembered("scan_speed_mm_s", 5);
/** One revolution and an overlap from which the closure error is determined. */
const from_deg = remembered("scan_from_deg", 0);
const to_deg = remembered("scan_to_deg", 375);
const step_deg = remembered("scan_step_deg", 1.5);
const speed_deg_s = remembered("scan_speed_deg_s", 15);

/** The form. Geometry is stored in this browser; the other settings apply to one scan. */
export class SetUp {
  readonly travel = { from: from_mm, to: to_mm, step: step_mm, speed: speed_mm_s };
  readonly turn = { from: from_deg, to: to_deg, step: step_deg, speed: speed_deg_s };
  readonly mode = mode;
  /** The exposure, or the longest of several. */
  readonly exposure_us = signal<number | undefined>(undefined);
  readonly n_exposures = signal<number>(1);
  /** Fraction of full power. */
  readonly laser_power = signal<number | undefined>(undefined);
  readonly name = signal("");
  readonly keep_frames = signal(false);
  /** Images with the laser off, subtracted from the frames. */
  readonly subtract_ambient = signal(false);
  /** Rows between two such images. */
  readonly ambient_rows = signal<number | undefined>(undefined);
  /** Ambient light below which it is not subtracted, grey levels of 255. */
  readonly ambient_levels = signal<number | undefined>(undefined);

  /** `rotary`: whether the stage is a turntable. */
  constructor(readonly rotary: ReadonlySignal<boolean>) {}
  readonly record = signal(false);

  /** The request body; empty fields are omitted. */
  readonly request = computed<StartScan>(() => {
    const continuous = this.mode.value === "continuous";
    const name = this.name.value.trim();
    return {
      source: { kind: "station" },
      mode: this.mode.value,
      ...(this.rotary.value ? this.rotaryRange(continuous) : this.linearRange(continuous)),
      ...this.exposures(continuous),
      ...(this.laser_power.value !== undefined && { laser_power: this.laser_power.value }),
      ...(name !== "" && { name }),
      ...(this.keep_frames.value && { keep_frames: true }),
      ...(this.subtract_ambient.value && { background: this.background(continuous) }),
      ...(this.record.value && { record: true }),
    };
  });

  /** Sets the number of exposures; several require a longest one. */
  setExposures(n: number): void {
    this.n_exposures.value = n;
    if (n > 1) this.exposure_us.value ??= FIRST_LONGEST_US;
  }

  private exposures(continuous: boolean): Pick<StartScan, "exposure_us" | "exposures_us"> {
    const longest_us = this.exposure_us.value;
    if (longest_us === undefined) return {};
    if (continuous || this.n_exposures.value === 1) return { exposure_us: longest_us };
    return { exposures_us: exposuresUpTo(longest_us, this.n_exposures.value) };
  }

  private background(continuous: boolean): Schemas["BackgroundDto"] {
    const [every_rows, above_levels] = [this.ambient_rows.value, this.ambient_levels.value];
    return {
      ...(every_rows !== undefined && !continuous && { every_rows }),
      ...(above_levels !== undefined && { above_levels }),
    };
  }

  private linearRange(continuous: boolean): Partial<StartScan> {
    const { from, to, step, speed } = this.travel;
    const pace = continuous ? { speed_mm_s: speed.value } : { step_mm: step.value };
    return { from_mm: from.value, to_mm: to.value, ...pace };
  }

  private rotaryRange(continuous: boolean): Partial<StartScan> {
    const { from, to, step, speed } = this.turn;
    const pace = continuous ? { speed_deg_s: speed.value } : { step_deg: step.value };
    return { from_deg: from.value, to_deg: to.value, ...pace };
  }
}
