/** Conversions of the measurement plan, which defines what Start scans and measures. */

import type { Schemas } from "../../api/client";
import type { Tool } from "../../state/choices";
import type { Plan } from "../../state/records/measurement_plan";

export type Characteristic = Schemas["MeasureDto"];

/** The request body of the scan and its measurements according to the plan. */
export function scanOf(plan: Plan, serial: string): Schemas["StartScanDto"] {
  const { exposure_us, measure, ...range } = plan;
  const name = serial.trim();
  return {
    source: { kind: "station" },
    ...range,
    measure: measure ?? [],
    ...(exposure_us == null ? {} : { exposure_us }),
    ...(name === "" ? {} : { name }),
  };
}

/** The scan range of a plan. */
export interface Range {
  from: number;
  to: number;
  step: number;
  unit: "mm" | "°";
}

/** The range of a plan, in millimetres or, on a turntable, in degrees. */
export function rangeOf({ from_mm, to_mm, step_mm, from_deg, to_deg, step_deg }: Plan): Range {
  if (from_deg != null) return { from: from_deg, to: to_deg ?? 0, step: step_deg ?? 1, unit: "°" };
  return { from: from_mm ?? 0, to: to_mm ?? 0, step: step_mm ?? 1, unit: "mm" };
}

/** The range as fields of the plan. */
export function planRange({ from, to, step, unit }: Range): Partial<Plan> {
  return unit === "°"
    ? { from_deg: from, to_deg: to, step_deg: step }
    : { from_mm: from, to_mm: to, step_mm: step };
}

/** A copy of a characteristic with some fields changed. Limits require a nominal value; that of flatness is zero. */
export function withChange(one: Characteristic, part: Partial<Characteristic>): Characteristic {
  const next = { ...one, ...part };
  const around = next.tool === "flatness" || next.nominal_mm != null;
  return around ? next : { ...next, tolerance_mm: null };
}

/** A name that is unique among the uses of the tool; undefined if the tool is not used yet. */
export function freeName(measure: readonly Characteristic[], tool: Tool): string | undefined {
  const names = measure.filter((one) => one.tool === tool).map((one) => one.name ?? "");
  if (names.length === 0) return undefined;
  let number = 2;
  while (names.includes(String(number))) number += 1;
  return String(number);
}
