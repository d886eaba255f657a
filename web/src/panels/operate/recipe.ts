/**
 * What is scanned and measured when Start is pressed, as this browser remembers it.
 * The seam for recipes of the server: the page reads `Recipe` and nothing else.
 */

import type { Schemas } from "../../api/client";
import { remembered } from "../../state/remembered";

export type Tool = Schemas["ToolDto"];
export const TOOLS: readonly Tool[] = ["sphere", "cylinder", "plane", "flatness", "step", "distance", "angle"];

export interface Recipe {
  from_mm: number;
  to_mm: number;
  step_mm: number;
  /** Undefined: as the station thinks best. */
  exposure_us: number | undefined;
  /** Undefined: scan only. */
  tool: Tool | undefined;
  /** mm; degrees for an angle. */
  nominal: number | undefined;
  tolerance: number | undefined;
}

/** A new station only scans; the simulated one has a sphere of known radius on its stage. */
export function firstRecipe(simulated: boolean): Recipe {
  const scan = { from_mm: -20, to_mm: 20, step_mm: 0.2, exposure_us: undefined };
  return simulated
    ? { ...scan, tool: "sphere", nominal: 18.9, tolerance: 0.05 }
    : { ...scan, tool: undefined, nominal: undefined, tolerance: undefined };
}

/** Reads what was kept; anything that does not fit is taken from `first`. */
export function parseRecipe(text: string, first: Recipe): Recipe {
  if (text === "") return first;
  let kept: Record<string, unknown>;
  try {
    kept = JSON.parse(text) as Record<string, unknown>;
  } catch {
    return first;
  }
  const must = (key: "from_mm" | "to_mm" | "step_mm") =>
    Number.isFinite(kept[key]) ? (kept[key] as number) : first[key];
  const may = (key: "exposure_us" | "nominal" | "tolerance") =>
    Number.isFinite(kept[key]) ? (kept[key] as number) : undefined;
  return {
    from_mm: must("from_mm"),
    to_mm: must("to_mm"),
    step_mm: must("step_mm"),
    exposure_us: may("exposure_us"),
    tool: TOOLS.find((tool) => tool === kept.tool),
    nominal: may("nominal"),
    tolerance: may("tolerance"),
  };
}

/** The scan that the recipe asks for. */
export function scanOf(recipe: Recipe, serial: string): Schemas["StartScanDto"] {
  const { from_mm, to_mm, step_mm, exposure_us } = recipe;
  const name = serial.trim();
  return {
    source: { kind: "station" },
    from_mm,
    to_mm,
    step_mm,
    ...(exposure_us === undefined ? {} : { exposure_us }),
    ...(name === "" ? {} : { name }),
  };
}

/** The measurement that follows; undefined: none. A tolerance needs a nominal to lie around. */
export function measurementOf({ tool, nominal, tolerance }: Recipe): Schemas["MeasureDto"] | undefined {
  if (!tool) return undefined;
  if (nominal === undefined) return { tool };
  return { tool, nominal_mm: nominal, ...(tolerance === undefined ? {} : { tolerance_mm: tolerance }) };
}

/** The text kept in the browser; empty until somebody changed something. */
export const kept_recipe = remembered("recipe", "");
