/** Lists, filters, trends and verdicts of results. */

import { expect, test } from "vitest";
import { filtered, NO_FILTER } from "../src/panels/results/filter";
import { toolsOf, trendOf } from "../src/panels/results/trend_data";
import { outcomeOf, standing } from "../src/state/outcome";
import { type Measured, measuredOf, type Scan, type ScannedPart } from "../src/state/scanned";

function measured(change: Partial<Measured> = {}): Measured {
  return {
    id: "m",
    at_ms: 0,
    tool: "sphere",
    unit: "mm",
    value: 18.9,
    expanded_uncertainty: 0.01,
    nominal: 18.9,
    tolerance: 0.05,
    verdict: "pass",
    rmse_mm: 0.02,
    ...change,
  };
}

function part(name: string, at: Date, list: Measured[] = [measured()], state = "complete"): ScannedPart {
  const scan = { id: name, name, created_at_ms: at.getTime(), state } as Scan;
  return { scan, measured: list };
}

const DAY = (day: number, hour = 12) => new Date(2026, 0, day, hour);

test("a measurement is read as far as a list needs it", () => {
  const told = {
    tool: "angle",
    value: 89.9,
    expanded_uncertainty: 0.2,
    nominal: null,
    verdict: null,
    errors: { rmse_mm: 0.03 },
  };
  const dto = { id: "a", scan_id: "s", created_at_ms: 5, request: {}, result: told };
  expect(measuredOf(dto)).toEqual({
    id: "a",
    at_ms: 5,
    tool: "angle",
    unit: "°",
    value: 89.9,
    expanded_uncertainty: 0.2,
    nominal: undefined,
    tolerance: undefined,
    verdict: undefined,
    rmse_mm: 0.03,
  });
  expect(measuredOf({ ...dto, result: { tool: "angle", value: null } })).toBeUndefined();
  expect(measuredOf({ ...dto, result: null })).toBeUndefined();
});

test("a scan that lost frames is never OK, whatever was measured", () => {
  expect(outcomeOf(part("a", DAY(1)))).toBe("pass");
  expect(outcomeOf(part("a", DAY(1), [measured()], "invalid"))).toBe("invalid");
  expect(outcomeOf(part("a", DAY(1), [measured()], "partial"))).toBe("partial");
  expect(outcomeOf(part("a", DAY(1), []))).toBe("scanned");
  expect(outcomeOf(part("a", DAY(1), [measured({ verdict: undefined })]))).toBe("measured");
  expect(outcomeOf(part("a", DAY(1), [measured({ verdict: "fail" }), measured()]))).toBe("fail");
});

test("the newest measurement with a verdict stands for a part", () => {
  const list = [measured({ id: "3", verdict: undefined }), measured({ id: "2" }), measured({ id: "1" })];
  expect(standing(part("a", DAY(1), list))?.id).toBe("2");
});

test("results are found by name, verdict and day", () => {
  const parts = [
    part("Alpha-1", DAY(3, 0)),
    part("alpha-2", DAY(2, 23), [measured({ verdict: "fail" })]),
    part("Beta", DAY(1)),
  ];
  const names = (change: object) => filtered(parts, { ...NO_FILTER, ...change }).map(({ scan }) => scan.name);
  expect(names({})).toHaveLength(3);
  expect(names({ name: " ALPHA" })).toEqual(["Alpha-1", "alpha-2"]);
  expect(names({ outcome: "fail" })).toEqual(["alpha-2"]);
  expect(names({ from_day: "2026-01-02", to_day: "2026-01-02" })).toEqual(["alpha-2"]);
  expect(names({ to_day: "2026-01-01" })).toEqual(["Beta"]);
});

test("a trend goes from the oldest part to the newest, one value per part, with the newest limits", () => {
  const parts = [
    part("new", DAY(3), [measured({ value: 3, tolerance: undefined, nominal: undefined, verdict: undefined })]),
    part("middle", DAY(2), [measured({ value: 2, tolerance: 0.2, verdict: "fail" }), measured({ value: 9 })]),
    part("flat", DAY(2), [measured({ tool: "flatness", value: 0.1 })]),
    part("old", DAY(1), [measured({ value: 1 })]),
  ];
  expect(toolsOf(parts)).toEqual(["sphere", "flatness"]);
  const trend = trendOf(parts, "sphere");
  expect(trend.points.map(({ name, value, bad }) => [name, value, bad])).toEqual([
    ["old", 1, false],
    ["middle", 2, true],
    ["new", 3, false],
  ]);
  expect([trend.nominal, trend.tolerance]).toEqual([18.9, 0.2]);
});
