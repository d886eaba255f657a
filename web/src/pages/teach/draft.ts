/** The plan of a recipe while it is taught on a scan. */

import type { Schemas } from "../../api/client";
import type { Box } from "../../scene/cloud/cloud";
import { type Vec3, vec3 } from "../../scene/cloud/shapes";
import { AXES } from "../../scene/cloud/space";
import type { Tool } from "../../state/choices";
import { featuresBelow } from "../viewer/plan_on_cloud";

export type Plan = Schemas["Plan"];
export type Characteristic = Schemas["PlanCharacteristic"];
export type PlanFeature = Schemas["PlanFeature"];
export type Fitted = Schemas["FeatureDto"];
/** What an inspection with a plan would say about a scan. */
export type Evaluation = Schemas["EvaluationDto"];

/** What can be taught in one step. */
export const TAUGHT = [
  "sphere_diameter",
  "sphere_radius",
  "cylinder_diameter",
  "cylinder_radius",
  "flatness",
  "step",
  "distance",
  "angle",
  "circle_diameter",
  "slot_width",
  "slot_length",
] as const;
export type Taught = (typeof TAUGHT)[number];

/** The tool that finds its features on the scan; the others are searched in the region by the plan alone. */
export const FOUND_BY: Partial<Record<Taught, Tool>> = {
  sphere_diameter: "sphere",
  sphere_radius: "sphere",
  cylinder_diameter: "cylinder",
  cylinder_radius: "cylinder",
  step: "step",
  distance: "distance",
  angle: "angle",
};

/** The feature and its measure, for what is measured of a single feature. */
const MEASURED = {
  sphere_diameter: ["sphere", "diameter"],
  sphere_radius: ["sphere", "radius"],
  cylinder_diameter: ["cylinder", "diameter"],
  cylinder_radius: ["cylinder", "radius"],
  circle_diameter: ["circle", "diameter"],
  slot_width: ["slot", "width"],
  slot_length: ["slot", "length"],
} as const satisfies Partial<Record<Taught, readonly [string, string]>>;

/** What was chosen and found for the next characteristic. */
export interface Candidate {
  taught: Taught;
  /** Where it was searched; everywhere if undefined. */
  region: Box | undefined;
  /** The features found by its tool. */
  found: readonly Fitted[];
}

/** Features and a characteristic of them, without limits. */
export interface Parts {
  features: readonly PlanFeature[];
  characteristic: Characteristic;
}

/** Margin around the points of a fitted feature, mm: parts do not lie in exactly the same place. */
const MARGIN_MM = 1;

/** The box around the points of a fitted feature. */
export function boxOf({ region }: Fitted): Box | undefined {
  if (!region || region.cells.length === 0) return undefined;
  const [nx = 1, ny = 1] = region.size;
  const min: Box["min"] = [Infinity, Infinity, Infinity];
  const max: Box["max"] = [-Infinity, -Infinity, -Infinity];
  const origin = vec3(region.origin_mm);
  for (const cell of region.cells) {
    const at: Vec3 = [cell % nx, Math.floor(cell / nx) % ny, Math.floor(cell / (nx * ny))];
    for (const axis of AXES) {
      min[axis] = Math.min(min[axis], origin[axis] + region.cell_mm * at[axis]);
      max[axis] = Math.max(max[axis], origin[axis] + region.cell_mm * (at[axis] + 1));
    }
  }
  return widened({ min, max }, MARGIN_MM);
}

function widened({ min, max }: Box, margin_mm: number): Box {
  return {
    min: [min[0] - margin_mm, min[1] - margin_mm, min[2] - margin_mm],
    max: [max[0] + margin_mm, max[1] + margin_mm, max[2] + margin_mm],
  };
}

/** The common part of two boxes. */
export function overlap(a: Box | undefined, b: Box | undefined): Box | undefined {
  if (!a || !b) return a ?? b;
  const min: Box["min"] = [
    Math.max(a.min[0], b.min[0]),
    Math.max(a.min[1], b.min[1]),
    Math.max(a.min[2], b.min[2]),
  ];
  const max: Box["max"] = [
    Math.min(a.max[0], b.max[0]),
    Math.min(a.max[1], b.max[1]),
    Math.min(a.max[2], b.max[2]),
  ];
  return { min, max };
}

/** The features and the characteristic for what was taught. `region`: where it was searched; everywhere if undefined. */
export function partsOf(taught: Taught, id: string, region: Box | undefined, fitted: readonly Fitted[]): Parts {
  const searched = (idx: number) => overlap(region, fitted[idx] && boxOf(fitted[idx]));
  const plane = (name: string, box: Box | undefined): PlanFeature => ({
    id: name,
    shape: { type: "plane", select: selectionOf(box) },
  });
  const select = selectionOf(region);
  const named = (suffix: string) => `${id}_${suffix}`;
  switch (taught) {
    case "sphere_diameter":
    case "sphere_radius":
    case "cylinder_diameter":
    case "cylinder_radius": {
      const [type, measure] = MEASURED[taught];
      const shape = fitted[0]?.shape;
      const radius = shape && shape.kind !== "plane" ? { radius_mm: rounded(shape.radius_mm) } : {};
      const feature: PlanFeature = { id: named(type), shape: { type, select, ...radius } };
      return { features: [feature], characteristic: { id, measure: { type: measure, of: named(type) } } };
    }
    case "flatness":
      return {
        features: [plane(named("plane"), region)],
        characteristic: { id, measure: { type: "flatness", of: named("plane") } },
      };
    case "step":
      return {
        features: [plane(named("base"), searched(0)), plane(named("top"), searched(1))],
        characteristic: { id, measure: { type: "step", base: named("base"), top: named("top") } },
      };
    case "distance":
    case "angle": {
      const shape = (idx: number): PlanFeature =>
        fitted[idx]?.shape.kind === "sphere"
          ? { id: named(`${idx + 1}`), shape: { type: "sphere", select: selectionOf(searched(idx)) } }
          : plane(named(`${idx + 1}`), searched(idx));
      return {
        features: [shape(0), shape(1)],
        characteristic: { id, measure: { type: taught, from: named("1"), to: named("2") } },
      };
    }
    case "circle_diameter":
    case "slot_width":
    case "slot_length": {
      const [type, measure] = MEASURED[taught];
      const rim: PlanFeature = { id: named(type), shape: { type, plane: named("plane"), select } };
      return {
        features: [plane(named("plane"), region), rim],
        characteristic: { id, measure: { type: measure, of: named(type) } },
      };
    }
  }
}

/** The points to search: those in a box; all without one. */
export function selectionOf(box: Box | undefined): Schemas["PlanSelection"] {
  if (!box) return {};
  return { region: { type: "box", min_mm: box.min.map(rounded), max_mm: box.max.map(rounded) } };
}

/** To 10 µm: a region needs no more, and stays readable. */
export function rounded(value_mm: number): number {
  return Number(value_mm.toFixed(2));
}

export const EMPTY_PLAN: Plan = { format: "sheaf-plan/1", seed: 1, features: [], characteristics: [] };

/** Why an id cannot be used for a new characteristic of a plan: `empty` or `used`. */
export function idFault(plan: Plan, id: string): "empty" | "used" | undefined {
  if (id === "") return "empty";
  const used = (one: { id: string }) => one.id === id || one.id.startsWith(`${id}_`);
  return plan.characteristics.some((one) => one.id === id) || plan.features.some(used) ? "used" : undefined;
}

export function withParts(plan: Plan, { features, characteristic }: Parts): Plan {
  return {
    ...plan,
    features: [...plan.features, ...features],
    characteristics: [...plan.characteristics, characteristic],
  };
}

/** Without a characteristic, and without the features that only it used. */
export function withoutCharacteristic(plan: Plan, id: string): Plan {
  const characteristics = plan.characteristics.filter((one) => one.id !== id);
  const used = (other: Plan) => usedFeatures(other);
  const [before, after] = [used(plan), used({ ...plan, characteristics })];
  const features = plan.features.filter((one) => after.has(one.id) || !before.has(one.id));
  return { ...plan, features, characteristics };
}

/** Ids of the features that the alignment and the characteristics use, directly or through other features. */
function usedFeatures(plan: Plan): ReadonlySet<string> {
  return featuresBelow(plan, [plan.alignment, plan.characteristics.map(({ measure }) => measure)]);
}

/** With another nominal value or limits of a characteristic. */
export function withLimits(plan: Plan, id: string, part: Limits): Plan {
  const change = (one: Characteristic): Characteristic =>
    one.id === id ? limited(one, { ...limitsIn(one), ...part }) : one;
  return { ...plan, characteristics: plan.characteristics.map(change) };
}

export interface Limits {
  nominal?: number | undefined;
  /** Smallest and largest permitted deviation from nominal. */
  lower?: number | undefined;
  upper?: number | undefined;
}

/** Measures that are never below 0, their nominal value: only an upper limit applies. */
const DEVIATIONS: readonly string[] = [
  "flatness",
  "parallelism",
  "perpendicularity",
  "position",
  "profile",
  "surface_profile",
];

export function isDeviation({ measure }: Pick<Characteristic, "measure">): boolean {
  return DEVIATIONS.includes(measure.type);
}

/** A name for a characteristic that has none yet. */
export function freeId(plan: Plan): string {
  for (let idx = 1; ; idx++) {
    const id = idx === 1 ? "new" : `new${idx}`;
    if (idFault(plan, id) === undefined) return id;
  }
}

export function unitOf({ measure }: Characteristic): "mm" | "°" {
  return measure.type === "angle" ? "°" : "mm";
}

export function limitsIn(one: Characteristic): Limits {
  const nominal = unitOf(one) === "°" ? one.nominal_deg : one.nominal_mm;
  return { nominal: nominal ?? undefined, lower: one.lower ?? undefined, upper: one.upper ?? undefined };
}

/** A characteristic with these limits only. */
export function limited(one: Characteristic, { nominal, lower, upper }: Limits): Characteristic {
  const { nominal_mm: _mm, nominal_deg: _deg, lower: _lower, upper: _upper, ...rest } = one;
  return {
    ...rest,
    ...(nominal !== undefined && (unitOf(one) === "°" ? { nominal_deg: nominal } : { nominal_mm: nominal })),
    ...(lower !== undefined && { lower }),
    ...(upper !== undefined && { upper }),
  };
}
