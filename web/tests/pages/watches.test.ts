import { describe, expect, it } from "vitest";
import type { Schemas } from "../../src/api/client";
import { trendOf, valueText, watchTone } from "../../src/pages/health/watch_trend";
import { exposuresUpTo } from "../../src/pages/scan/acquisition";

type Verdict = Schemas["WatchVerdictDto"];

function verdict(
  watch: Verdict["watch"],
  state: Verdict["state"],
  value: number | null = null,
  sigma: number | null = null,
): Verdict {
  return { watch, state, value, sigma, reason: "" };
}

describe("figures of watches", () => {
  it("are in the unit people read, with U = 2 σ", () => {
    expect(valueText(verdict("wavelength", "warning", 1.5e-3, 1e-4), "en")).toBe("1,500 ± 200 ppm");
    expect(valueText(verdict("order_powers", "warning", -0.255, 0.03), "en")).toBe("−25.5 ± 6.0 %");
    expect(valueText(verdict("lost_steps", "invalid", 0.058, 0.01), "en")).toBe("58.0 µm ± 20.0 µm");
    expect(valueText(verdict("lost_steps", "quiet", 0, 0.04), "en")).toBe("0 (< 40.0 µm)");
    expect(valueText(verdict("stage_scale", "blind"), "en")).toBe("–");
  });

  it("make a trend of the scans in which the watch saw something", () => {
    const reading = (of: Verdict): Schemas["WatchReadingDto"] => ({
      scan_id: "s",
      scan_name: "part",
      calibration_id: "c",
      at_ms: 0,
      verdicts: [of],
    });
    const readings = [
      verdict("stage_scale", "quiet", 1e-4, 2e-4),
      verdict("stage_scale", "blind"),
      verdict("stage_scale", "warning", 4e-3, 5e-4),
    ].map(reading);
    const trend = trendOf({ readings, n_reference_scans: 3, n_reference_scans_needed: 5 }, "stage_scale");
    expect(trend).toEqual([
      { value: 1e-4, u: 4e-4, bad: false },
      { value: 4e-3, u: 1e-3, bad: true },
    ]);
    expect(["quiet", "blind", "warning", "invalid"].map((state) => watchTone(state as Verdict["state"]))).toEqual([
      "calm",
      "calm",
      "caution",
      "alarm",
    ]);
  });
});

describe("exposures of a row", () => {
  it("go up to the longest by sixes", () => {
    expect(exposuresUpTo(3600, 3)).toEqual([100, 600, 3600]);
    expect(exposuresUpTo(4000, 2)).toEqual([667, 4000]);
  });
});
