/** Formatting of the values of calibrations. */

import { language, text } from "../../../text";
import { decimal } from "../../../units";

export function px(value: number | null | undefined, digits = 3): string {
  return value == null ? "–" : `${decimal(value, digits, language.value)} px`;
}

export function um(value_mm: number | null | undefined, digits = 1): string {
  return value_mm == null ? "–" : `${decimal(1e3 * value_mm, digits, language.value)} µm`;
}

export function mm(value_mm: number | null | undefined, digits = 1): string {
  return value_mm == null ? "–" : `${decimal(value_mm, digits, language.value)} mm`;
}

export function degrees(value: number | null | undefined, digits = 1): string {
  return value == null ? "–" : `${decimal(value, digits, language.value)}°`;
}

export function share(value: number, digits = 3): string {
  return `${decimal(100 * value, digits, language.value)} %`;
}

/** Time since `at_ms`, in minutes, hours or days. */
export function age(at_ms: number, now_ms: number): string {
  const words = text.value.calibration;
  const minutes = Math.floor((now_ms - at_ms) / 60_000);
  if (minutes < 60) return words.minutes(minutes);
  if (minutes < 48 * 60) return words.hours(Math.floor(minutes / 60));
  return words.days(Math.floor(minutes / (24 * 60)));
}
