/** The outcome of a scanned part: the server's verdict, or why there is none. */

import type { Measured, ScannedPart, Verdict } from "./scanned";

/** A verdict, or why there is none. `measured`: a value without tolerance. */
export type Outcome = Verdict | "partial" | "measured" | "scanned";

/** From the best to the worst. */
export const VERDICTS: readonly Verdict[] = ["ok", "undecided", "invalid", "not_ok"];

/** The characteristic displayed for the part: the one with the worst verdict, else the newest. */
export function decidingCharacteristic({ measured }: ScannedPart): Measured | undefined {
  const worst = [...VERDICTS].reverse().find((verdict) => measured.some((one) => one.verdict === verdict));
  return measured.find((one) => worst !== undefined && one.verdict === worst) ?? measured[0];
}

export function outcomeOf({ scan, measured }: ScannedPart): Outcome {
  if (scan.verdict) return scan.verdict;
  if (scan.state === "partial") return "partial";
  return measured.length > 0 ? "measured" : "scanned";
}

/** All outcomes, as listed in filters. */
export const OUTCOMES: readonly Outcome[] = [
  "ok",
  "undecided",
  "invalid",
  "not_ok",
  "partial",
  "measured",
  "scanned",
];

/** Symbols that distinguish outcomes without colour. */
export const OUTCOME_SYMBOL: Record<Outcome, string> = {
  ok: "✓",
  undecided: "?",
  invalid: "!",
  not_ok: "✕",
  partial: "…",
  measured: "•",
  scanned: "–",
};
