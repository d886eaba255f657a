/** Signals stored in the browser. */

import { afterEach, expect, test, vi } from "vitest";
import { remembered } from "../../src/state/browser/remembered";

afterEach(() => vi.unstubAllGlobals());

/** A storage with one value. */
function stored(name: string, value: string): void {
  const values = new Map([[`sheaf.${name}`, value]]);
  vi.stubGlobal("localStorage", {
    getItem: (key: string) => values.get(key) ?? null,
    setItem: (key: string, text: string) => values.set(key, text),
  });
}

test("a stored value is used if it has the type of the initial one", () => {
  stored("step_mm", "0.5");
  expect(remembered("step_mm", 0.2).value).toBe(0.5);
  stored("step_mm", '"0.5"');
  expect(remembered("step_mm", 0.2).value).toBe(0.2);
  stored("step_mm", "{");
  expect(remembered("step_mm", 0.2).value).toBe(0.2);
});

test("a stored value that is no longer a choice is ignored", () => {
  const choices = ["light", "dark"] as const;
  stored("theme", '"dark"');
  expect(remembered("theme", "light", choices).value).toBe("dark");
  stored("theme", '"sepia"');
  expect(remembered("theme", "light", choices).value).toBe("light");
});
