import { expect, test } from "vitest";
import { eighthsFor, FULL_EIGHTHS } from "../../src/scene/image/jpeg";

test("an image is decoded no coarser than it is shown, and never finer than it is", () => {
  const cases = [
    [0.336, 3],
    [0.375, 3],
    [0.376, 4],
    [0.5, 4],
    [0.99, FULL_EIGHTHS],
    [1, FULL_EIGHTHS],
    [6, FULL_EIGHTHS],
    [0.01, 1],
  ] as const;
  for (const [scale, eighths] of cases) expect(eighthsFor(scale), String(scale)).toBe(eighths);
});
