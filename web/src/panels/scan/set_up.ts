/** What a person asks of a scan, as the form holds it and as the server wants it. */

import { computed, signal } from "@preact/signals";
import type { Schemas } from "../../api/client";
import { remembered } from "../../state/browser/remembered";

export type StartScan = Schemas["StartScanDto"];
export type Mode = "stop_and_go" | "continuous";

const from_mm = remembered("scan_from_mm", -20);
const to_mm = remembered("scan_to_mm", 20);
const step_mm = remembered("scan_step_mm", 0.2);
const mode = remembered<Mode>("scan_mode", "stop_and_go");
const speed_mm_s = remembered("scan_speed_mm_s", 5);

/** The form. Geometry is remembered by this browser; light and name are those of one scan. */
export class SetUp {
  readonly from_mm = from_mm;
  readonly to_mm = to_mm;
  readonly step_mm = step_mm;
  readonly mode = mode;
  readonly speed_mm_s = speed_mm_s;
  readonly exposure_us = signal<number | undefined>(undefined);
  readonly laser_percent = signal<number | undefined>(undefined);
  readonly name = signal("");
  readonly keep_frames = signal(false);
  readonly record = signal(false);

  /** As the server wants it; what was left empty is left to the server. */
  readonly wanted = computed<StartScan>(() => {
    const continuous = this.mode.value === "continuous";
    const name = this.name.value.trim();
    return {
      source: { kind: "station" },
      mode: this.mode.value,
      from_mm: this.from_mm.value,
      to_mm: this.to_mm.value,
      ...(continuous ? { speed_mm_s: this.speed_mm_s.value } : { step_mm: this.step_mm.value }),
      ...(this.exposure_us.value !== undefined && { exposure_us: this.exposure_us.value }),
      ...(this.laser_percent.value !== undefined && { laser_power: this.laser_percent.value / 100 }),
      ...(name !== "" && { name }),
      ...(this.keep_frames.value && { keep_frames: true }),
      ...(this.record.value && { record: true }),
    };
  });
}
