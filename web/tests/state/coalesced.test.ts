import { expect, test } from "vitest";
import { coalesced } from "../../src/state/coalesced";

test("work requested two hundred times at once is done twice: now, and after the last request", async () => {
  const ends: (() => void)[] = [];
  const wanted = coalesced(() => new Promise((end) => ends.push(end)));
  const all = Array.from({ length: 200 }, () => wanted());
  expect(ends).toHaveLength(1);
  ends[0]?.();
  await new Promise((soon) => setTimeout(soon));
  expect(ends).toHaveLength(2);
  ends[1]?.();
  await Promise.all(all);
  expect(ends).toHaveLength(2);
  void wanted();
  expect(ends).toHaveLength(3);
});

test("work that failed can be requested again", async () => {
  let n = 0;
  const wanted = coalesced(async () => {
    n += 1;
    if (n === 1) throw new Error("once");
  });
  await expect(wanted()).rejects.toThrow("once");
  await wanted();
  expect(n).toBe(2);
});
