/** A block on the table of the simulated station, and a recipe that judges its height. */

import type { Schemas } from "../../src/api/client";
import type { Server } from "./server";
import { type Corner, placePart, stlOf, type Triangle } from "./stl";

/** Nominal height of the block, mm. */
export const HEIGHT_MM = 8.9;

/** What a part is made wrong by, mm: twice what the recipe permits, seven times U. */
export const DEFECT_MM = 0.06;

/** Corners of the faces, by bits of x, y, z. */
const FACES = [
  [0, 2, 3, 1],
  [4, 5, 7, 6],
  [0, 1, 5, 4],
  [2, 6, 7, 3],
  [0, 4, 6, 2],
  [1, 3, 7, 5],
] as const;

/** A block of this height, 20 mm × 16 mm, in the middle of the stage. */
export function block(height_mm: number): readonly Triangle[] {
  const corner = (idx: number): Corner => [idx & 1 ? 10 : -10, idx & 2 ? 8 : -8, idx & 4 ? height_mm : 0];
  return FACES.flatMap(([a, b, c, d]): Triangle[] => [
    [corner(a), corner(b), corner(c)],
    [corner(a), corner(c), corner(d)],
  ]);
}

/** Puts a block of this height on the stage. */
export async function placeBlock(server: Server, height_mm: number): Promise<void> {
  await placePart(server, stlOf(block(height_mm)));
}

/** A recipe for the block: its height, within ±`tolerance_mm`, and the flatness of its top, without limits. */
export function blockRecipe(tolerance_mm: number): Schemas["RecipeDto"] {
  const region = { type: "box" as const, min_mm: [-8, -6, 380], max_mm: [8, 6, 396] };
  return {
    name: "Block",
    scan: { from_mm: -12, to_mm: 12, step_mm: 0.8 },
    plan: {
      format: "sheaf-plan/1",
      features: [
        { id: "table", shape: { type: "plane" } },
        { id: "top", shape: { type: "plane", select: { region } } },
      ],
      characteristics: [
        { id: "flat", measure: { type: "flatness", of: "top" } },
        {
          id: "height",
          measure: { type: "step", base: "table", top: "top" },
          nominal_mm: HEIGHT_MM,
          lower: -tolerance_mm,
          upper: tolerance_mm,
        },
      ],
    },
  } as Schemas["RecipeDto"];
}
