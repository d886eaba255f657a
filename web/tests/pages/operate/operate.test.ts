/** What Operate decides without a server. */

import { expect, test } from "vitest";
import type { Job, Station } from "../../../src/api/client";
import { lastOf } from "../../../src/pages/operate/last_part";
import { freeName, scanOf, withChange } from "../../../src/pages/operate/plan";
import { type Obstacle, obstacleOf } from "../../../src/pages/operate/readiness";
import { barPlaces } from "../../../src/pages/operate/tolerance_bar";
import type { Plan } from "../../../src/state/records/measurement_plan";
import type { ScannedPart } from "../../../src/state/records/scanned";

function station(change: object = {}): Station {
  return {
    state: "Operational.Ready",
    job_id: null,
    laser: { interlock_closed: true },
    stage: { needs_homing: true, homed: true },
    ...change,
  } as Station;
}

test("a scan that cannot start says the first reason", () => {
  const ready = { stale: false, status: station(), calibrated: true, busy: false };
  const cases: [object, Obstacle | undefined][] = [
    [{}, undefined],
    [{ stale: true }, "no_link"],
    [{ status: undefined }, "no_link"],
    [{ status: station({ state: "Halted" }), calibrated: false }, "halted"],
    [{ status: station({ state: "Error" }) }, "fault"],
    [{ status: station({ state: "Preoperational" }) }, "no_devices"],
    [{ busy: true }, "busy"],
    [{ status: station({ job_id: "a" }) }, "busy"],
    [{ status: station({ laser: { interlock_closed: false } }) }, "interlock_open"],
    [{ status: station({ laser: { interlock_closed: null } }) }, undefined],
    [{ calibrated: false }, "not_calibrated"],
    [{ calibrated: undefined }, undefined],
    [{ status: station({ stage: { needs_homing: true, homed: false } }) }, "not_homed"],
    [{ status: station({ stage: { needs_homing: false, homed: false } }) }, undefined],
  ];
  for (const [change, obstacle] of cases)
    expect(obstacleOf({ ...ready, ...change }), JSON.stringify(change)).toBe(obstacle);
});

const PLAN: Plan = {
  from_mm: -20,
  to_mm: 20,
  step_mm: 0.2,
  measure: [{ tool: "sphere", nominal_mm: 18.9, tolerance_mm: 0.05 }],
};

test("a scan is asked for with what is measured on it; an empty serial number is left to the server", () => {
  expect(scanOf(PLAN, "  ")).toEqual({ source: { kind: "station" }, ...PLAN });
  expect(scanOf({ ...PLAN, exposure_us: 500 }, " A-1 ")).toMatchObject({ name: "A-1", exposure_us: 500 });
});

test("limits need a nominal to lie around, but for flatness", () => {
  const sphere = { tool: "sphere" as const, nominal_mm: 18.9, tolerance_mm: 0.05 };
  expect(withChange(sphere, { nominal_mm: null })).toMatchObject({ nominal_mm: null, tolerance_mm: null });
  expect(withChange({ tool: "flatness" }, { tolerance_mm: 0.1 })).toMatchObject({ tolerance_mm: 0.1 });
});

test("a second use of a tool gets a name of its own", () => {
  expect(freeName([], "sphere")).toBeUndefined();
  expect(freeName([{ tool: "sphere" }, { tool: "step" }], "sphere")).toBe("2");
  expect(freeName([{ tool: "sphere" }, { tool: "sphere", name: "2" }], "sphere")).toBe("3");
});

test("the last verdict is gone as soon as the next scan was started", () => {
  const part = (job_id: string, created_at_ms: number) =>
    ({ scan: { id: job_id, name: job_id, job_id, created_at_ms }, measured: [] }) as unknown as ScannedPart;
  const job = (id: string, state: string, created_at_ms: number) =>
    ({ id, kind: "scan", state, created_at_ms, input: { kind: "scan", name: "next" } }) as unknown as Job;
  const known = [part("a", 10)];
  expect(lastOf(known, job("a", "succeeded", 5)).kind).toBe("part");
  expect(lastOf(known, job("b", "queued", 20))).toEqual({ kind: "running", name: "next" });
  expect(lastOf(known, job("b", "running", 20)).kind).toBe("running");
  // Ended, and its part is not read yet or there is none: never the one before.
  for (const state of ["succeeded", "failed", "cancelled", "interrupted"])
    expect(lastOf(known, job("b", state, 20)).kind, state).toBe("without_part");
  expect(lastOf([part("b", 30), ...known], job("b", "cancelled", 20)).kind).toBe("part");
  // Computed again after the scan.
  expect(lastOf([part("c", 40)], job("b", "succeeded", 20)).kind).toBe("part");
  expect(lastOf([], undefined).kind).toBe("none");
});

test("the tolerance takes the middle half of the bar; what lies far out sits at its edge", () => {
  const limits = { nominal: 10, lower: 9.5, upper: 10.5 };
  const places = barPlaces({ ...limits, value: 10.25, u: 0.1 });
  expect(places).toMatchObject({ lower: 0.25, nominal: 0.5, upper: 0.75, beyond: false });
  expect(places?.value).toBeCloseTo(0.625, 12);
  expect([places?.u_from, places?.u_to]).toEqual([expect.closeTo(0.575, 12), expect.closeTo(0.675, 12)]);
  expect(barPlaces({ ...limits, value: 99, u: 0.1 })).toMatchObject({ value: 1, u_to: 1, beyond: true });
});

test("limits may be unequal or on one side; without a range there is no bar", () => {
  const value = { value: 10, u: 0 };
  const unequal = barPlaces({ ...value, nominal: 10, lower: 9.95, upper: 10.1 });
  expect(unequal).toMatchObject({ lower: 0.25, upper: 0.75, nominal: expect.closeTo(0.25 + 0.5 / 3, 9) });
  const upper = barPlaces({ nominal: 0, lower: undefined, upper: 0.05, value: 0.025, u: 0.01 });
  expect(upper).toMatchObject({ lower: undefined, nominal: 0.25, upper: 0.75, value: expect.closeTo(0.5, 9) });
  const lower = barPlaces({ nominal: 10, lower: 9, upper: undefined, value: 10.5, u: 0.1 });
  expect(lower).toMatchObject({ lower: 0.25, nominal: 0.75, upper: undefined, value: 1 });
  expect(barPlaces({ ...value, nominal: 10, lower: undefined, upper: undefined })).toBeUndefined();
  expect(barPlaces({ ...value, nominal: undefined, lower: 9, upper: undefined })).toBeUndefined();
});
