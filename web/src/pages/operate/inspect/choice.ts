/** How Start works: by a recipe, by the rule on the serial number, or as a scan without a recipe. */

import type { Recipe } from "../../../state/records/recipes";

/** Stored choice: the recipe whose rule matches the serial number. No recipe id contains a slash. */
export const BY_SERIAL = "/serial";

/** Stored choice: a scan without a recipe. */
export const SCAN_ONLY = "/scan";

export type Choice =
  | { kind: "scan_only" }
  | { kind: "by_serial" }
  /** `version`: undefined is the newest. */
  | { kind: "recipe"; recipe: Recipe; version: number | undefined }
  /** There are several recipes, and none was chosen. */
  | { kind: "none" };

/** The choice for `stored`: `bracket`, `bracket@7`, `BY_SERIAL`, `SCAN_ONLY`, or "" for none. */
export function choiceOf(recipes: readonly Recipe[], stored: string): Choice {
  const [only] = recipes;
  if (!only || stored === SCAN_ONLY) return { kind: "scan_only" };
  const has_rule = recipes.some(({ serial_pattern }) => serial_pattern != null);
  if (stored === BY_SERIAL && has_rule) return { kind: "by_serial" };
  const [id, version] = stored.split("@");
  const recipe = recipes.find((one) => one.id === id);
  if (recipe) return { kind: "recipe", recipe, version: versionIn(recipe, version) };
  if (stored !== "" && stored !== BY_SERIAL) return { kind: "none" };
  if (has_rule) return { kind: "by_serial" };
  return recipes.length === 1 ? { kind: "recipe", recipe: only, version: undefined } : { kind: "none" };
}

function versionIn(recipe: Recipe, text: string | undefined): number | undefined {
  const version = Number(text);
  return Number.isInteger(version) && version >= 1 && version <= recipe.version ? version : undefined;
}

/** The choice as it is stored. */
export function storedChoice(choice: Choice): string {
  if (choice.kind === "scan_only") return SCAN_ONLY;
  if (choice.kind === "by_serial") return BY_SERIAL;
  if (choice.kind === "none") return "";
  return choice.version === undefined ? choice.recipe.id : `${choice.recipe.id}@${choice.version}`;
}

/** Versions that can be chosen, newest first: all are consecutive numbers. */
export function versionsOf({ version }: Pick<Recipe, "version">, most = 50): readonly number[] {
  return Array.from({ length: Math.min(version, most) }, (_, idx) => version - idx);
}
