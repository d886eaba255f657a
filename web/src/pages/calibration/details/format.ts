/** Formatting of the values of calibrations. */

import type { Schemas } from "../../../api/client";
import { language, text } from "../../../text";
import { dateTime, decimal } from "../../../units";

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

/** Which dark frames the images were corrected with, or that there was none. */
export function correction_text(correction: Schemas["ImageCorrectionDto"] | null | undefined): string {
  const words = text.value.calibration;
  if (!correction) return words.dark_frame_unknown;
  if (correction.n_corrected === 0) return words.dark_frame_none;
  const parts = correction.dark_frames.flatMap((dark) => [
    words.dark_frame_of(
      dateTime(dark.taken_at_ms, language.value),
      `${decimal(1e-3 * dark.exposure_us, 1, language.value)} ms`,
      String(dark.n_hot_pixels),
    ),
    ...(dark.used === "hot_pixels" ? [words.dark_frame_hot_pixels_only] : []),
  ]);
  if (correction.n_corrected < correction.n_images) {
    parts.push(words.dark_frame_some(String(correction.n_corrected), String(correction.n_images)));
  }
  return parts.join("; ");
}

/** Time since `at_ms`, in minutes, hours or days. */
export function age(at_ms: number, now_ms: number): string {
  const words = text.value.calibration;
  const minutes = Math.floor((now_ms - at_ms) / 60_000);
  if (minutes < 60) return words.minutes(minutes);
  if (minutes < 48 * 60) return words.hours(Math.floor(minutes / 60));
  return words.days(Math.floor(minutes / (24 * 60)));
}
