/** Values of characteristics as text. */

import type { CharacteristicResult } from "../../state/records/inspections";
import { language, text } from "../../text";
import { decimal, length } from "../../units";

/** A value of a characteristic with its unit; "–" if undefined. */
export function withUnit(value: number | null | undefined, { unit }: Pick<CharacteristicResult, "unit">): string {
  return value == null ? "–" : `${decimal(value, 3, language.value)} ${unit}`;
}

/** U with its unit: small lengths in µm. */
export function uncertaintyOf({ expanded_uncertainty: u, unit }: CharacteristicResult): string {
  return unit === "mm" ? length(u, language.value) : withUnit(u, { unit });
}

/** Display name of the measured quantity. */
export function measureName({ measure }: Pick<CharacteristicResult, "measure">): string {
  return text.value.inspections.measures[measure] ?? measure;
}
