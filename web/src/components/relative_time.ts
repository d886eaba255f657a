/** Times relative to now: "12 seconds ago", "in 5 minutes". */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";

/** Units with their length, and the shortest time that is shown in them: up to two days in hours. */
const UNITS = [
  { unit: "day", length_s: 86_400, from_s: 2 * 86_400 },
  { unit: "hour", length_s: 3600, from_s: 3600 },
  { unit: "minute", length_s: 60, from_s: 60 },
  { unit: "second", length_s: 1, from_s: 1 },
] as const;

/** Formats a time relative to now, in whole units, rounded towards now. */
export function relativeTime(at_ms: number, now_ms: number, language: string): string {
  const seconds = (at_ms - now_ms) / 1000;
  const chosen = UNITS.find(({ from_s }) => Math.abs(seconds) >= from_s);
  if (!chosen) return new Intl.RelativeTimeFormat(language, { numeric: "auto" }).format(0, "second");
  const whole = Math.trunc(seconds / chosen.length_s);
  return new Intl.RelativeTimeFormat(language, { numeric: "always" }).format(whole, chosen.unit);
}

/** The time of this browser, ms since 1970; renders the component again every second. */
export function useNow(): number {
  const now_ms = useSignal(Date.now());
  useEffect(() => {
    const timer = setInterval(() => {
      now_ms.value = Date.now();
    }, 1000);
    return () => clearInterval(timer);
  }, [now_ms]);
  return now_ms.value;
}
