/** The way to an exposure: from what a histogram says to what is asked of the camera. */

import { expect, test } from "vitest";
import { exposureFactor } from "../src/panels/live/auto_exposure";

const advice = (kind: "over" | "under" | "good", bright: number) => ({ kind, bright, saturated: 0 });

test("too long is halved, too short goes to where lines are bright, by four at most", () => {
  expect(exposureFactor(advice("over", 1), false)).toBe(0.5);
  expect(exposureFactor(advice("over", 1), true)).toBe(0.5);
  expect(exposureFactor(advice("under", 0.2), false)).toBeCloseTo(3);
  expect(exposureFactor(advice("under", 0), false)).toBe(4);
});

test("what is right stays, and what was shortened is not lengthened again", () => {
  expect(exposureFactor(advice("good", 0.5), false)).toBeUndefined();
  expect(exposureFactor(advice("under", 0.2), true)).toBeUndefined();
});
