/** What a scanned part is called at a glance. */

import type { Measured, ScannedPart } from "./scanned";

/** `invalid`: frames were lost, no verdict may stand on it. `measured`: a value without tolerance. */
export type Outcome = "pass" | "fail" | "undecided" | "invalid" | "partial" | "measured" | "scanned";

/** The measurement that stands for the part: the newest with a verdict, else the newest. */
export function standing({ measured }: ScannedPart): Measured | undefined {
  return measured.find((one) => one.verdict !== undefined) ?? measured[0];
}

export function outcomeOf(part: ScannedPart): Outcome {
  if (part.scan.state === "invalid") return "invalid";
  if (part.scan.state === "partial") return "partial";
  const measured = standing(part);
  if (!measured) return "scanned";
  return measured.verdict ?? "measured";
}

/** A sign that says the same without colour. */
export const SIGN: Record<Outcome, string> = {
  pass: "✓",
  fail: "✕",
  undecided: "?",
  invalid: "!",
  partial: "…",
  measured: "•",
  scanned: "–",
};
