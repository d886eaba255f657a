/** Keys, titles and the log of events. */

import { expect, test } from "vitest";
import { titleOf } from "../../src/frame/title";
import { PAGES } from "../../src/state/browser/route";
import { PAGE_LETTERS, Shortcuts } from "../../src/state/browser/shortcuts";
import { joined, type StationEvent } from "../../src/state/records/events";
import { de } from "../../src/text/de";
import { en } from "../../src/text/en";

const PLAIN = { altKey: false, ctrlKey: false, metaKey: false, code: "" };

test("g and a letter lead to a page, if the letter follows soon", () => {
  const keys = new Shortcuts();
  const press = (key: string, now_ms: number, letters = true) => keys.follow({ ...PLAIN, key }, letters, now_ms);
  expect(press("l", 0)).toBeUndefined();
  expect(press("g", 10)).toBeUndefined();
  expect(press("l", 500)).toBe("live");
  expect(press("l", 600)).toBeUndefined();
  press("g", 1000);
  expect(press("l", 9000)).toBeUndefined();
  press("g", 10_000);
  expect(press("l", 10_100, false)).toBeUndefined();
  expect(press("?", 11_000)).toBe("shortcuts");
});

test("Alt and a digit lead to a page, also while typing; with Control they are somebody else's", () => {
  const keys = new Shortcuts();
  const digit = { ...PLAIN, key: "¡", code: "Digit1", altKey: true };
  expect(keys.follow(digit, false, 0)).toBe("operate");
  expect(keys.follow({ ...digit, code: "Digit9" }, false, 0)).toBe("help");
  expect(keys.follow({ ...digit, code: "Digit0" }, false, 0)).toBeUndefined();
  expect(keys.follow({ ...digit, ctrlKey: true }, true, 0)).toBeUndefined();
});

test("every page has a letter of its own", () => {
  expect(new Set(PAGES.map((page) => PAGE_LETTERS[page])).size).toBe(PAGES.length);
});

test("the window's title says state and page, and when the link is lost", () => {
  expect(titleOf(en, "live", "Operational.Ready", false)).toBe("Ready · Live · Sheaf");
  expect(titleOf(de, "jobs", "Halted", false)).toBe("Gestoppt · Aufträge · Sheaf");
  expect(titleOf(en, "live", "Operational.Ready", true)).toBe("no connection · Live · Sheaf");
  expect(titleOf(en, "live", undefined, false)).toBe("Live · Sheaf");
});

test("events received twice are listed once, newest first", () => {
  const event = (seq: number) =>
    ({ seq, kind: "door.recovered", subject: "s", body: {}, at_ms: 0 }) satisfies StationEvent;
  const list = joined(joined([], [event(1), event(2)]), [event(2), event(4), event(3)]);
  expect(list.map(({ seq }) => seq)).toEqual([4, 3, 2, 1]);
});
