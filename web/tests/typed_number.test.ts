/** What number fields make of what people type: a number that was meant, or words. */

import { beforeEach, expect, test } from "vitest";
import { Form } from "../src/components/fields/form";
import { type Limits, readTyped, written } from "../src/components/fields/typed_number";
import { language } from "../src/text";
import { en } from "../src/text/en";

const { not_a_number, not_whole } = en.common;

beforeEach(() => {
  language.value = "en";
});

function check(typed: string, limits: Limits, expected: number | undefined | string, chosen = "en"): void {
  const read = readTyped(typed, limits, chosen);
  expect("wrong" in read ? read.wrong : read.value, typed).toBe(expected);
}

test("no number is made of a part of what was typed", () => {
  for (const typed of ["12abc", "5e-2", "1e3", "abc", "12 mm", "1.2.3", "--1", "0x10", "1 500", "Infinity", ""]) {
    check(typed, {}, not_a_number);
  }
});

test("beyond a limit is wrong, whatever its first digits are", () => {
  check("1500", { min: -100, max: 100 }, "allowed: −100 to 100");
  check("15", { min: -100, max: 100 }, 15);
  check("-100.001", { min: -100, max: 100 }, "allowed: −100 to 100");
  check("0", { min: 1e-6, optional: true }, "allowed: 0.000001 to ∞");
});

test("only an empty field is empty, and only where it may be", () => {
  check("  ", { optional: true }, undefined);
  check("abc", { optional: true }, not_a_number);
  check("", {}, not_a_number);
});

test("what reads as thousands here and as a fraction elsewhere is asked for again", () => {
  check("1,500", {}, "ambiguous: enter 1500 or 1.5");
  check("1.500", {}, "ambiguous: enter 1500 or 1,5", "de");
  check("1.500", {}, 1.5);
  check("1,500", {}, 1.5, "de");
  check("0,125", {}, 0.125);
  check("1,5", {}, 1.5);
});

test("a count is not rounded", () => {
  check("9.5", { whole: true }, not_whole);
  check("9", { whole: true }, 9);
});

test("what is shown can be typed", () => {
  for (const value of [-20, 0.2, 18.9, 1234.5, 0.000001]) {
    for (const chosen of ["en", "de"]) check(written(value, chosen), {}, value, chosen);
  }
});

test("a form is blocked by its first wrong field until that is right or gone", () => {
  const form = new Form();
  expect(form.blocked.value).toBeUndefined();
  form.note("a", "A: not a number.");
  form.note("b", "B: not a number.");
  expect(form.blocked.value).toBe("A: not a number.");
  form.note("a", undefined);
  expect(form.blocked.value).toBe("B: not a number.");
  form.note("b", undefined, true);
  expect(form.pending.value).toBe(true);
  form.note("b", undefined);
  expect(form.pending.value).toBe(false);
  expect(form.blocked.value).toBeUndefined();
});
