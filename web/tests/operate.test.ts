/** What Operate decides without a server. */

import { expect, test } from "vitest";
import type { Station } from "../src/api/client";
import { type Obstacle, obstacleOf } from "../src/panels/operate/readiness";
import { firstRecipe, measurementOf, parseRecipe, scanOf } from "../src/panels/operate/recipe";
import { barPlaces } from "../src/panels/operate/tolerance_bar";

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

test("what the browser kept is taken as far as it makes sense", () => {
  const first = firstRecipe(true);
  expect(parseRecipe("", first)).toEqual(first);
  expect(parseRecipe("no json", first)).toEqual(first);
  const kept = parseRecipe('{"from_mm":-5,"to_mm":"x","step_mm":null,"tool":"teapot","nominal":3}', first);
  expect(kept).toEqual({ ...first, from_mm: -5, tool: undefined, nominal: 3, tolerance: undefined });
  const whole = { ...first, exposure_us: 800, tolerance: 0.01 };
  expect(parseRecipe(JSON.stringify(whole), first)).toEqual(whole);
});

test("an empty serial number and an automatic exposure are left to the server", () => {
  const recipe = firstRecipe(true);
  expect(scanOf(recipe, "  ")).toEqual({ source: { kind: "station" }, from_mm: -20, to_mm: 20, step_mm: 0.2 });
  expect(scanOf({ ...recipe, exposure_us: 500 }, " A-1 ")).toMatchObject({ name: "A-1", exposure_us: 500 });
});

test("a real station only scans at first; a tolerance without a nominal asks for no verdict", () => {
  expect(measurementOf(firstRecipe(false))).toBeUndefined();
  expect(measurementOf(firstRecipe(true))).toEqual({ tool: "sphere", nominal_mm: 18.9, tolerance_mm: 0.05 });
  expect(measurementOf({ ...firstRecipe(true), nominal: undefined })).toEqual({ tool: "sphere" });
});

test("the tolerance takes the middle half of the bar; what lies far out sits at its edge", () => {
  const places = barPlaces(10, 0.5, 10.25, 0.1);
  expect([places.lower, places.nominal, places.upper]).toEqual([0.25, 0.5, 0.75]);
  expect(places.value).toBeCloseTo(0.625, 12);
  expect([places.u_from, places.u_to]).toEqual([expect.closeTo(0.575, 12), expect.closeTo(0.675, 12)]);
  expect(places.beyond).toBe(false);
  const far = barPlaces(10, 0.5, 99, 0.1);
  expect([far.value, far.u_to, far.beyond]).toEqual([1, 1, true]);
});
