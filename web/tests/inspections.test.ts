/** Inspections: limits, order and the filter in the address. */

import { expect, test } from "vitest";
import { exportHref, filterOf, queryOf, serverQuery } from "../src/pages/inspections/filter";
import { type CharacteristicResult, limitsOf, utilisation, worstFirst } from "../src/state/records/inspections";

const result = (id: string, part: Partial<CharacteristicResult>) =>
  ({ id, nominal: 10, lower: -0.1, upper: 0.3, value: 10, verdict: "ok", ...part }) as CharacteristicResult;

test("limits are deviations from nominal, and may lie on one side", () => {
  const both = limitsOf(result("a", {}));
  expect([both.lower, both.upper]).toEqual([expect.closeTo(9.9, 12), expect.closeTo(10.3, 12)]);
  expect(limitsOf(result("a", { nominal: 0, lower: null, upper: 0.2 }))).toEqual({ lower: undefined, upper: 0.2 });
});

test("1 of the tolerance is used on a limit, whichever it is", () => {
  const used = (part: Partial<CharacteristicResult>) => utilisation(result("a", part));
  expect(used({ value: 10.1 })).toBeCloseTo(0, 9);
  expect(used({ value: 9.9 })).toBeCloseTo(1, 9);
  expect(used({ value: 10.3 })).toBeCloseTo(1, 9);
  expect(used({ nominal: 0, lower: null, value: 0.15 })).toBeCloseTo(0.5, 9);
  expect(used({ lower: -0.1, upper: null, value: 9.95 })).toBeCloseTo(0.5, 9);
  expect(used({ value: null })).toBeUndefined();
  expect(used({ lower: null, upper: null })).toBeUndefined();
});

test("the worst comes first: by verdict, then by how much of the tolerance it uses", () => {
  const results = [
    result("without limits", { lower: null, upper: null, verdict: null }),
    result("ok", { value: 10.1 }),
    result("ok, near", { value: 10.25 }),
    result("invalid", { value: null, verdict: "invalid" }),
    result("undecided", { value: 10.3, verdict: "undecided" }),
    result("far out", { value: 11, verdict: "not_ok" }),
    result("out", { value: 10.4, verdict: "not_ok" }),
  ];
  const order = ["far out", "out", "invalid", "undecided", "ok, near", "ok", "without limits"];
  expect(worstFirst(results).map(({ id }) => id)).toEqual(order);
});

test("the filter is what stands in the address; days are whole, of this time zone", () => {
  const filter = filterOf(new URLSearchParams("serial=+BL-1&verdict=not_ok&from=2026-11-24&to=2026-11-24&x=1"));
  expect(queryOf(filter)).toEqual({ serial: "BL-1", verdict: "not_ok", from: "2026-11-24", to: "2026-11-24" });
  expect(serverQuery(filter)).toEqual({
    serial: "BL-1",
    verdict: "not_ok",
    from_ms: new Date(2026, 10, 24).getTime(),
    to_ms: new Date(2026, 10, 25).getTime(),
  });
  expect(serverQuery(filterOf(new URLSearchParams("verdict=fine&from=soon")))).toEqual({});
});

test("the export is of what the filter selects, with any text encoded", () => {
  const href = exportHref(
    filterOf(new URLSearchParams({ serial: "A&B 1", verdict: "not_ok", from: "2026-11-24" })),
    "dfq",
  );
  const { pathname, searchParams } = new URL(href, "http://localhost");
  expect(pathname).toBe("/api/v1/inspections/export");
  expect(Object.fromEntries(searchParams)).toEqual({
    format: "dfq",
    serial: "A&B 1",
    verdict: "not_ok",
    from_ms: `${new Date(2026, 10, 24).getTime()}`,
  });
  expect(exportHref(filterOf(new URLSearchParams()), "csv")).toBe("/api/v1/inspections/export?format=csv");
});
