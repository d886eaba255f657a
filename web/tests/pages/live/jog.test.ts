import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Jog } from "../../../src/pages/live/controls/jog";

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "performance"] });
});
afterEach(() => {
  vi.useRealTimers();
});

test("a held button repeats well within the server's 300 ms, and letting go stops at once", async () => {
  const said: { velocity: number; at_ms: number }[] = [];
  const jog = new Jog(
    async (velocity) => void said.push({ velocity, at_ms: performance.now() }),
    () => undefined,
  );
  jog.hold(-2);
  await vi.advanceTimersByTimeAsync(550);
  const gaps = said.slice(1).map(({ at_ms }, idx) => at_ms - (said[idx]?.at_ms ?? 0));
  expect(said.length).toBeGreaterThanOrEqual(5);
  expect(Math.max(...gaps)).toBeLessThanOrEqual(150);
  expect(said.every(({ velocity }) => velocity === -2)).toBe(true);
  const released_at = performance.now();
  jog.release();
  await vi.advanceTimersByTimeAsync(0);
  expect(said.at(-1)).toEqual({ velocity: 0, at_ms: released_at });
  const n = said.length;
  await vi.advanceTimersByTimeAsync(1000);
  expect(said).toHaveLength(n);
});

test("a refusal ends the jog and is reported; nothing is repeated", async () => {
  const failures: unknown[] = [];
  let n = 0;
  const jog = new Jog(
    async () => {
      n += 1;
      throw new Error("no control");
    },
    (cause) => failures.push(cause),
  );
  jog.hold(2);
  await vi.advanceTimersByTimeAsync(1000);
  expect([n, failures.length]).toEqual([1, 1]);
});
