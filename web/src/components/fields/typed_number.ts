/** Parses the text of a number field: a number, nothing, or an error message. */

import { text } from "../../text";
import { isAmbiguous, parseDecimal } from "../../units";

export interface Limits {
  min?: number | undefined;
  max?: number | undefined;
  /** Whether the field may be empty. */
  optional?: boolean | undefined;
  /** Whether the number must be whole. */
  whole?: boolean | undefined;
}

/** The whole text is parsed; nothing is truncated, rounded or clamped. */
export type Typed = { value: number | undefined } | { wrong: string };

export function readTyped(typed: string, limits: Limits, language: string): Typed {
  const words = text.value.common;
  const { min = Number.NEGATIVE_INFINITY, max = Number.POSITIVE_INFINITY } = limits;
  if (typed.trim() === "" && limits.optional) return { value: undefined };
  const value = parseDecimal(typed);
  if (value === undefined || !Number.isFinite(value)) return { wrong: words.not_a_number };
  if (isAmbiguous(typed, language)) {
    return { wrong: words.ambiguous(typed.trim().replace(/[.,]/, ""), written(value, language)) };
  }
  if (limits.whole && !Number.isInteger(value)) return { wrong: words.not_whole };
  const shown = (limit: number) =>
    Number.isFinite(limit) ? written(limit, language).replace("-", "−") : limit < 0 ? "−∞" : "∞";
  return value < min || value > max ? { wrong: words.out_of_range(shown(min), shown(max)) } : { value };
}

/** A value as it would be typed. */
export function written(value: number | undefined, language: string): string {
  if (value === undefined) return "";
  return value.toLocaleString(language, { maximumFractionDigits: 6, useGrouping: false });
}
