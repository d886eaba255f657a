/** Formatting and parsing of numbers in the chosen language, with units. */

/** A number with fixed decimals; "–" if undefined. */
export function decimal(value: number | null | undefined, digits: number, language: string): string {
  if (value == null || !Number.isFinite(value)) return "–";
  // A typographic minus sign, so that columns of numbers align.
  return value
    .toLocaleString(language, { minimumFractionDigits: digits, maximumFractionDigits: digits })
    .replace("-", "−");
}

/** A whole number with thousands separators. */
export function count(value: number | null | undefined, language: string): string {
  return decimal(value, 0, language);
}

/** A length in mm or, if it is small, in µm. */
export function length(value_mm: number | null | undefined, language: string): string {
  if (value_mm == null || !Number.isFinite(value_mm)) return "–";
  const small = Math.abs(value_mm) < 0.1;
  return small ? `${decimal(1e3 * value_mm, 1, language)} µm` : `${decimal(value_mm, 3, language)} mm`;
}

/** A duration in hours, minutes and seconds. */
export function duration(value_s: number | null | undefined, language: string): string {
  if (value_s == null || !Number.isFinite(value_s)) return "–";
  if (value_s < 10) return `${decimal(value_s, 1, language)} s`;
  const seconds = Math.round(value_s);
  const [hours, minutes] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60];
  if (hours > 0) return `${hours} h ${minutes} min`;
  return minutes > 0 ? `${minutes} min ${seconds % 60} s` : `${seconds} s`;
}

/** A size in bytes, with decimal prefixes. */
export function bytes(value: number | null | undefined, language: string): string {
  if (value == null || !Number.isFinite(value)) return "–";
  const units = ["B", "kB", "MB", "GB", "TB"];
  const power = Math.min(units.length - 1, Math.max(0, Math.floor(Math.log10(Math.max(value, 1)) / 3)));
  return `${decimal(value / 1000 ** power, power === 0 ? 0 : 1, language)} ${units[power]}`;
}

/** Local date and time, with the month as a word, so that it is unambiguous in every country. */
export function dateTime(at_ms: number | null | undefined, language: string): string {
  if (at_ms == null) return "–";
  return new Date(at_ms).toLocaleString(language, { dateStyle: "medium", timeStyle: "medium", hourCycle: "h23" });
}

/**
 * Parses a typed number: point or comma as decimal separator, ASCII or typographic minus. The whole text must be a
 * number, else the result is `undefined`.
 */
export function parseDecimal(text: string): number | undefined {
  const plain = text.trim().replace(/[−–]/g, "-").replace(",", ".");
  return /^[-+]?(\d+\.?\d*|\.\d+)$/.test(plain) ? Number(plain) : undefined;
}

/** Whether a text like "1,500" could mean thousands or a decimal fraction in the chosen language. */
export function isAmbiguous(text: string, language: string): boolean {
  const grouping = language === "de" ? /^[-+−–]?[1-9]\d{0,2}\.\d{3}$/ : /^[-+−–]?[1-9]\d{0,2},\d{3}$/;
  return grouping.test(text.trim());
}
