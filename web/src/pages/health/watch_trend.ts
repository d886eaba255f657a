/** The values of the watches over the last scans. */

import type { Schemas } from "../../api/client";
import { decimal, length } from "../../units";
import type { Tone } from "./tone";

export type Watch = Schemas["WatchDto"];
export type Verdict = Schemas["WatchVerdictDto"];
type History = Schemas["WatchHistoryDto"];

export const WATCHES: readonly Watch[] = ["lost_steps", "wavelength", "order_powers", "stage_scale"];

/** A monitored value of one scan. */
export interface TrendValue {
  value: number;
  /** Expanded uncertainty, k = 2. */
  u: number;
  bad: boolean;
}

export function watchTone(state: Schemas["WatchStateDto"]): Tone {
  return state === "invalid" ? "alarm" : state === "warning" ? "caution" : "calm";
}

export function latestOf(history: History, watch: Watch): Verdict | undefined {
  return history.readings.at(-1)?.verdicts.find((verdict) => verdict.watch === watch);
}

/** Values of a watch, oldest first; scans without a value are omitted. */
export function trendOf(history: History, watch: Watch): readonly TrendValue[] {
  return history.readings.flatMap(({ verdicts }) => {
    const verdict = verdicts.find((one) => one.watch === watch);
    if (verdict?.value == null) return [];
    const bad = watchTone(verdict.state) !== "calm";
    // Without lost steps, σ is the smallest detectable loss, not an uncertainty.
    const u = watch === "lost_steps" && !bad ? 0 : 2 * (verdict.sigma ?? 0);
    return [{ value: verdict.value, u, bad }];
  });
}

/** A monitored value as text: µm, ppm or %; "–" if it could not be measured. */
export function valueText({ watch, state, value, sigma }: Verdict, language: string): string {
  if (value == null) return "–";
  if (watch === "lost_steps") {
    if (state === "quiet") return `0 (< ${length(sigma, language)})`;
    return `${length(value, language)} ± ${length(2 * (sigma ?? 0), language)}`;
  }
  const [by, unit, digits] = watch === "order_powers" ? [100, "%", 1] : [1e6, "ppm", 0];
  const shown = (of: number) => decimal(by * of, digits, language);
  return `${shown(value)} ± ${shown(2 * (sigma ?? 0))} ${unit}`;
}
