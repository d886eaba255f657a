/** What is scanned and measured when Start is pressed, as the server's measurement plan says. */

import type { Schemas } from "../../api/client";
import type { Tool } from "../../state/choices";
import type { Plan } from "../../state/records/measurement_plan";

export type Characteristic = Schemas["MeasureDto"];

/** The scan that the plan asks for, with what is measured on it. */
export function scanOf(plan: Plan, serial: string): Schemas["StartScanDto"] {
  const { from_mm, to_mm, step_mm, exposure_us, measure } = plan;
  const name = serial.trim();
  return {
    source: { kind: "station" },
    from_mm,
    to_mm,
    step_mm,
    measure: measure ?? [],
    ...(exposure_us == null ? {} : { exposure_us }),
    ...(name === "" ? {} : { name }),
  };
}

/** A characteristic with a part of it changed; limits need a nominal to lie around, flatness has zero. */
export function changed(one: Characteristic, part: Partial<Characteristic>): Characteristic {
  const next = { ...one, ...part };
  const around = next.tool === "flatness" || next.nominal_mm != null;
  return around ? next : { ...next, tolerance_mm: null };
}

/** A name that no other use of the tool has; undefined where the tool is not used yet. */
export function freeName(measure: readonly Characteristic[], tool: Tool): string | undefined {
  const names = measure.filter((one) => one.tool === tool).map((one) => one.name ?? "");
  if (names.length === 0) return undefined;
  let number = 2;
  while (names.includes(String(number))) number += 1;
  return String(number);
}
