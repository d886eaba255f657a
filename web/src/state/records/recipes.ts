/** The recipes in use, for choosing one. */

import { type Api, data, type Schemas } from "../../api/client";
import type { Damaged } from "./damaged";

export type Recipe = Schemas["RecipeItemDto"];

/** Recipes per request. */
const AT_ONCE = 200;

export interface Recipes {
  /** By name. */
  items: readonly Recipe[];
  damaged: readonly Damaged[];
}

/** All recipes that are not archived. */
export async function readRecipes(api: Api): Promise<Recipes> {
  const items: Recipe[] = [];
  const damaged: Damaged[] = [];
  for (let before: string | undefined; ; before = items.at(-1)?.id) {
    const query = { archived: false, limit: AT_ONCE, ...(before !== undefined && { before }) };
    const page = await data(api.GET("/api/v1/recipes", { params: { query } }));
    items.push(...page.items);
    damaged.push(...(page.damaged ?? []));
    if (!page.next || page.items.length === 0) break;
  }
  return { items: items.sort((a, b) => a.name.localeCompare(b.name)), damaged };
}
