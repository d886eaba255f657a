import { expect, test } from "vitest";
import { bytes, decimal, duration, length, parseDecimal } from "../src/units";

test("a person may write a decimal comma, a point, and any minus", () => {
  const cases: [string, number | undefined][] = [
    ["0,2", 0.2],
    ["0.2", 0.2],
    [" −20 ", -20],
    ["-,5", -0.5],
    ["3.", 3],
    ["", undefined],
    ["1,000.5", undefined],
    ["2 mm", undefined],
    ["1e3", undefined],
  ];
  for (const [typed, value] of cases) expect(parseDecimal(typed), typed).toBe(value);
});

test("numbers are written in the chosen language, with a minus sign", () => {
  expect(decimal(-1234.5, 2, "en")).toBe("−1,234.50");
  expect(decimal(-1234.5, 2, "de")).toBe("−1.234,50");
  expect(decimal(undefined, 2, "en")).toBe("–");
  expect(decimal(Number.NaN, 2, "en")).toBe("–");
});

test("small lengths are written in micrometres", () => {
  expect(length(0.0083, "en")).toBe("8.3 µm");
  expect(length(18.9, "de")).toBe("18,900 mm");
});

test("durations and bytes are written in units of their size", () => {
  expect(duration(3.21, "en")).toBe("3.2 s");
  expect(duration(75, "en")).toBe("1 min 15 s");
  expect(duration(7260, "en")).toBe("2 h 1 min");
  expect(bytes(1_500_000, "de")).toBe("1,5 MB");
  expect(bytes(0, "en")).toBe("0 B");
});
