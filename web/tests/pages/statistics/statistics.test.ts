/** Statistics: the selection in the address, and what the control charts show. */

import { expect, test } from "vitest";
import {
  type ControlChart,
  extent,
  individualsOf,
  movingRangesOf,
  violatedAt,
} from "../../../src/pages/statistics/chart_data";
import { queryOf, referenceOf, selectionOf, seriesQuery } from "../../../src/pages/statistics/selection";
import { parseRoute, railEntryOf } from "../../../src/state/browser/route";

test("the page is part of the results", () => {
  expect(railEntryOf(parseRoute("#/statistics/block?characteristic=height").page)).toBe("results");
  expect(railEntryOf("live")).toBe("live");
});

test("the selection is what stands in the address; what is no number is not sent", () => {
  const text =
    "characteristic=height&version=2&serial=+M-1&from=2026-11-24&to=2026-11-24&limit=25&reference=8.9&x=1";
  const selection = selectionOf(new URLSearchParams(text));
  expect(queryOf(selection)).toEqual({
    characteristic: "height",
    version: "2",
    serial: "M-1",
    from: "2026-11-24",
    to: "2026-11-24",
    limit: "25",
    reference: "8.9",
  });
  expect(seriesQuery(selection)).toEqual({
    version: 2,
    serial: "M-1",
    from_ms: new Date(2026, 10, 24).getTime(),
    to_ms: new Date(2026, 10, 25).getTime(),
    limit: 25,
  });
  expect(referenceOf(selection)).toBe(8.9);
  const wrong = selectionOf(new URLSearchParams("version=x&limit=0&from=soon&reference=8,9"));
  expect([seriesQuery(wrong), referenceOf(wrong)]).toEqual([{}, undefined]);
});

const chart = (part: Partial<ControlChart>): ControlChart =>
  ({
    unit: "mm",
    readings: [1, 3, null, 4, 10].map((value, seq) => ({ seq, inspection_id: `i${seq}`, serial: "S", value })),
    n_missing: 1,
    individuals: { lower: 0, centre: 4, upper: 8 },
    moving_range: { lower: 0, centre: 2, upper: 5 },
    violations: [],
    ...part,
  }) as unknown as ControlChart;

test("a part without a value is a gap, and so are the moving ranges beside it", () => {
  expect(individualsOf(chart({})).values).toEqual([1, 3, null, 4, 10]);
  const ranges = movingRangesOf(chart({}));
  expect(ranges.values).toEqual([null, 2, null, null, 6]);
  expect(ranges.lines.map(({ name, value }) => [name, value])).toEqual([
    ["centre", 2],
    ["upper_control", 5],
  ]);
  expect([...ranges.violated]).toEqual([[4, [1]]]);
  expect(ranges.from_zero).toBe(true);
});

test("specification limits far outside would flatten the chart and are left out of it", () => {
  const names = (part: Partial<ControlChart>) => individualsOf(chart(part)).lines.map(({ name }) => name);
  const control = ["lower_control", "centre", "upper_control"];
  expect(names({ lower_limit: -5, upper_limit: 15 })).toEqual([...control, "lower_limit", "upper_limit"]);
  expect(names({ lower_limit: -100, upper_limit: 15 })).toEqual([...control, "upper_limit"]);
  expect(names({ lower_limit: null })).toEqual(control);
});

test("a pattern is marked at its last point, with every rule once", () => {
  const violations = [
    { rule: 2, first_idx: 0, last_idx: 8 },
    { rule: 1, first_idx: 8, last_idx: 8 },
    { rule: 1, first_idx: 8, last_idx: 8 },
    { rule: 3, first_idx: 4, last_idx: 9 },
  ];
  expect([...violatedAt(violations)]).toEqual([
    [8, [1, 2]],
    [9, [3]],
  ]);
});

test("the extent ignores gaps", () => {
  expect(extent([2, null, -1])).toEqual([-1, 2]);
  expect(extent([null])).toEqual([0, 1]);
});
