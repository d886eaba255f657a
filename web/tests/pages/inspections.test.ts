/** Inspections: limits, order and the filter in the address. */

import { afterEach, expect, test } from "vitest";
import { dataFiles } from "../../src/pages/inspections/files";
import { exportHref, filterOf, queryOf, serverQuery } from "../../src/pages/inspections/filter";
import { chartThen, patternOf } from "../../src/pages/inspections/values";
import { type CharacteristicResult, limitsOf, utilisation, worstFirst } from "../../src/state/records/inspections";
import { language } from "../../src/text";

afterEach(() => {
  language.value = "en";
});

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

test("the data of one inspection are files of it alone, named by part and number", () => {
  const { json, csv, dfq } = dataFiles({
    id: "i1",
    seq: 7,
    serial: "A&B 1",
    created_at_ms: 1_795_000_000_000,
    recipe: { id: "block", version: 2 },
  });
  expect(json).toEqual({ href: "/api/v1/inspections/i1", download: "A&B 1_7.json" });
  expect(dfq).toEqual({ href: "/api/v1/inspections/i1/report?format=dfq", download: "A&B 1_7.dfq" });
  const { pathname, searchParams } = new URL(csv.href, "http://localhost");
  expect([pathname, csv.download]).toEqual(["/api/v1/inspections/export", "A&B 1_7.csv"]);
  // The end of a selection is not part of it.
  expect(Object.fromEntries(searchParams)).toEqual({
    format: "csv",
    serial: "A&B 1",
    recipe: "block@2",
    from_ms: "1795000000000",
    to_ms: "1795000000001",
  });
});

test("a violated run rule has the words of the control chart, with its number; an unknown one has its number", () => {
  expect(patternOf({ rule: 2 })).toBe("nine values on one side of the mean (rule 2)");
  expect(patternOf({ rule: 99 })).toBe("Rule 99");
  language.value = "de";
  expect(patternOf({ rule: 1 })).toBe("ein Wert jenseits von 3 σ (Regel 1)");
});

test("the value that violated a rule is shown with mean and σ of that time, small lengths in µm", () => {
  const violated = { value: 8.92, centre: 8.9001, sigma: 0.0012, unit: "mm" };
  expect(chartThen(violated)).toBe("8.9200 mm; mean 8.9001 mm, σ 1.2 µm");
  expect(chartThen({ ...violated, sigma: 0.02, unit: "°" })).toBe("8.9200 °; mean 8.9001 °, σ 0.0200 °");
  language.value = "de";
  expect(chartThen(violated)).toBe("8,9200 mm; Mittelwert 8,9001 mm, σ 1,2 µm");
});
