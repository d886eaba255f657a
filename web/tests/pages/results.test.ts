/** Lists, filters, trends and verdicts of results. */

import { expect, test, vi } from "vitest";
import type { Api } from "../../src/api/client";
import { filterOf, NO_FILTER, queryOf, serverQuery } from "../../src/pages/results/filter";
import { ResultsState } from "../../src/pages/results/results_state";
import { characteristicsOf, trendOf } from "../../src/pages/results/trend_data";
import type { EventLog, StationEvent } from "../../src/state/records/events";
import { decidingCharacteristic, OUTCOMES, outcomeOf } from "../../src/state/records/outcome";
import {
  type Measured,
  type PartsQuery,
  partOf,
  type Scan,
  type ScannedPart,
} from "../../src/state/records/scanned";

function measured(change: Partial<Measured> = {}): Measured {
  return {
    id: "m",
    at_ms: 0,
    tool: "sphere",
    name: undefined,
    unit: "mm",
    value: 18.9,
    expanded_uncertainty: 0.01,
    nominal: 18.9,
    tolerance: 0.05,
    verdict: "ok",
    rmse_mm: 0.02,
    ...change,
  };
}

function part(
  name: string,
  at: Date,
  list: Measured[] = [measured()],
  told: Partial<Scan> = { verdict: list[0]?.verdict ?? null },
): ScannedPart {
  const scan = { id: name, name, created_at_ms: at.getTime(), state: "complete", ...told } as Scan;
  return { scan, measured: list };
}

const DAY = (day: number, hour = 12) => new Date(2026, 0, day, hour);

test("characteristics come with the scan, one of them without a value", () => {
  const one = { measurement_id: "a", created_at_ms: 5, tool: "angle", unit: "°", verdict: "invalid" };
  const scan = { id: "s", characteristics: [one] } as unknown as Scan;
  expect(partOf(scan).measured[0]).toEqual({
    id: "a",
    at_ms: 5,
    tool: "angle",
    name: undefined,
    unit: "°",
    value: undefined,
    expanded_uncertainty: undefined,
    nominal: undefined,
    tolerance: undefined,
    verdict: "invalid",
    rmse_mm: undefined,
  });
});

test("the verdict on a part is the server's; without one its state says what it is", () => {
  expect(outcomeOf(part("a", DAY(1), [measured()], { verdict: "not_ok" }))).toBe("not_ok");
  expect(outcomeOf(part("a", DAY(1), [], { state: "partial", verdict: "invalid" }))).toBe("invalid");
  expect(outcomeOf(part("a", DAY(1), [], { state: "partial" }))).toBe("partial");
  expect(outcomeOf(part("a", DAY(1), [], {}))).toBe("scanned");
  expect(outcomeOf(part("a", DAY(1), [measured({ verdict: undefined })], {}))).toBe("measured");
});

test("the worst characteristic stands for a part, else the newest", () => {
  const list = [
    measured({ id: "3" }),
    measured({ id: "2", verdict: "not_ok" }),
    measured({ id: "1", verdict: "invalid" }),
  ];
  expect(decidingCharacteristic(part("a", DAY(1), list))?.id).toBe("2");
  expect(decidingCharacteristic(part("a", DAY(1), [measured({ id: "4", verdict: undefined })]))?.id).toBe("4");
});

test("the server finds by name, time and outcome; days are whole, of this time zone", () => {
  const query = (change: object) => serverQuery({ ...NO_FILTER, ...change });
  expect(query({})).toEqual({});
  expect(query({ name: " ALPHA ", from_day: "2026-01-02", to_day: "2026-01-02" })).toEqual({
    name: "ALPHA",
    from_ms: DAY(2, 0).getTime(),
    to_ms: DAY(3, 0).getTime(),
  });
  expect(query({ outcome: "not_ok" })).toEqual({ verdict: "not_ok" });
});

test("an outcome asks for the parts that have it", () => {
  const parts = [
    part("judged", DAY(1)),
    part("stopped", DAY(1), [], { state: "partial", verdict: null }),
    part("without limits", DAY(1), [measured({ verdict: undefined })], { verdict: null }),
    part("bare", DAY(1), [], { verdict: null }),
  ];
  // As the server applies it.
  const fits = ({ scan, measured }: ScannedPart, query: PartsQuery) =>
    (query.verdict === undefined || query.verdict === scan.verdict) &&
    (query.state === undefined || query.state === scan.state) &&
    (query.judged === undefined || query.judged === Boolean(scan.verdict)) &&
    (query.measured === undefined || query.measured === measured.length > 0);
  for (const outcome of OUTCOMES) {
    const query = serverQuery({ ...NO_FILTER, outcome });
    const [found, expected] = [
      parts.filter((one) => fits(one, query)),
      parts.filter((one) => outcomeOf(one) === outcome),
    ];
    expect(found, outcome).toEqual(expected);
  }
});

test("a trend goes from the oldest part to the newest, one value per part, with the newest limits", () => {
  const parts = [
    part("new", DAY(3), [measured({ value: 3, tolerance: undefined, nominal: undefined, verdict: undefined })]),
    part("middle", DAY(2), [
      measured({ value: 2, tolerance: 0.2, verdict: "not_ok" }),
      measured({ value: 9, name: "second" }),
    ]),
    part("flat", DAY(2), [measured({ tool: "flatness", value: 0.1 })]),
    part("old", DAY(1), [measured({ value: 1 })]),
  ];
  expect(characteristicsOf(parts)).toEqual(["sphere", "sphere/second", "flatness"]);
  const trend = trendOf(parts, "sphere");
  expect(trend.points.map(({ name, value, bad }) => [name, value, bad])).toEqual([
    ["old", 1, false],
    ["middle", 2, true],
    ["new", 3, false],
  ]);
  expect([trend.nominal, trend.tolerance]).toEqual([18.9, 0.2]);
});

test("a list of more than one page keeps its length when something happens", async () => {
  const all = Array.from({ length: 300 }, (_, idx) => ({ id: `s${300 - idx}`, characteristics: [] }));
  const limits: number[] = [];
  const GET = (_: string, { params }: { params: { query: { limit: number; before?: string } } }) => {
    const { limit, before } = params.query;
    limits.push(limit);
    const from = before === undefined ? 0 : all.findIndex(({ id }) => id === before) + 1;
    const items = all.slice(from, from + limit);
    const next = from + limit < all.length ? "more" : null;
    return Promise.resolve({ data: { items, damaged: [], next }, response: new Response() });
  };
  let tell = (_: StationEvent[]): void => undefined;
  const events = {
    follow: (listener: typeof tell) => {
      tell = listener;
      return () => undefined;
    },
  };
  const results = new ResultsState({ GET } as unknown as Api, events as unknown as EventLog, {});
  results.follow();
  await vi.waitFor(() => expect(results.parts.value).toHaveLength(50));
  for (let more = 0; more < 4; more++) await results.older.start();
  expect(results.parts.value).toHaveLength(250);
  expect(results.has_older.value).toBe(true);
  const first = results.parts.value?.[0];
  limits.length = 0;
  tell([{ kind: "scan.created" } as StationEvent]);
  await vi.waitFor(() => expect(limits).toEqual([200, 50]));
  await vi.waitFor(() => expect(results.parts.value?.[0]).not.toBe(first));
  expect(results.parts.value?.map(({ scan }) => scan.id)).toEqual(all.slice(0, 250).map(({ id }) => id));
  expect(results.has_older.value).toBe(true);
});

test("the filter is part of the address, which says nothing about fields that are not set", () => {
  const filter = { name: "BR 12", outcome: "not_ok" as const, from_day: "2026-11-02", to_day: "" };
  const query = new URLSearchParams(queryOf(filter));
  expect(query.toString()).toBe("name=BR+12&outcome=not_ok&from=2026-11-02");
  expect(filterOf(query)).toEqual(filter);
  expect(filterOf(new URLSearchParams("outcome=great"))).toEqual(NO_FILTER);
  expect(queryOf(NO_FILTER)).toEqual({});
});
