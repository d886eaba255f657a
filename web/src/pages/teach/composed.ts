/** Features taught one by one, and characteristics that are measured from several of them. */

import type { Box } from "../../scene/cloud/cloud";
import { type Characteristic, type Plan, type PlanFeature, selectionOf } from "./draft";

/** Shapes that are fitted to the points of a region. */
export const FEATURE_TYPES = ["plane", "sphere", "cylinder", "circle", "slot", "edge"] as const;
export type FeatureType = (typeof FEATURE_TYPES)[number];

/** What a feature provides to a measure. */
type Kind = "plane" | "line" | "point" | "section";

const KINDS: Record<PlanFeature["shape"]["type"], Kind> = {
  plane: "plane",
  sphere: "point",
  cylinder: "line",
  circle: "point",
  slot: "point",
  edge: "line",
  line: "line",
  point: "point",
  section: "section",
};

/** Whether a shape is the rim of a plane, which it names. */
export function needsPlane(type: FeatureType): type is "circle" | "slot" | "edge" {
  return type === "circle" || type === "slot" || type === "edge";
}

/** A feature that is searched in a region; `plane`: that of a rim. */
export function featureFrom(type: FeatureType, id: string, region: Box | undefined, plane: string): PlanFeature {
  const select = selectionOf(region);
  return { id, shape: needsPlane(type) ? { type, plane, select } : { type, select } };
}

/** A feature that a measure needs. */
interface Role {
  name: string;
  kinds: readonly Kind[];
}

/** Whatever has a place or a direction. */
export const ANY: readonly Kind[] = ["plane", "line", "point"];

/** The features of each measure, in the order in which they are asked for. */
export const ROLES = {
  parallelism: [role("of", "plane"), role("to", "plane")],
  perpendicularity: [role("of", "plane"), role("to", "plane")],
  distance: [role("from", ...ANY), role("to", ...ANY)],
  angle: [role("from", "plane", "line"), role("to", "plane", "line")],
  flush: [role("reference", "plane"), role("surface", "plane")],
  gap: [role("from", "line"), role("to", "line"), role("surface", "plane")],
  groove_depth: [role("floor", "plane"), role("shoulder_1", "plane"), role("shoulder_2", "plane")],
  coordinate_x: [role("of", "point")],
  coordinate_y: [role("of", "point")],
  coordinate_z: [role("of", "point")],
} satisfies Record<string, readonly Role[]>;
export type Composed = keyof typeof ROLES;

export const COMPOSED = Object.keys(ROLES) as readonly Composed[];

function role(name: string, ...kinds: Kind[]): Role {
  return { name, kinds };
}

export function rolesOf(composed: Composed): readonly Role[] {
  return ROLES[composed];
}

/** Ids of the features of a plan that can have a role. */
export function candidates({ features }: Plan, { kinds }: Role): readonly string[] {
  return features.filter(({ shape }) => kinds.includes(KINDS[shape.type])).map(({ id }) => id);
}

/** The characteristic of the chosen features; undefined if one is missing, or chosen twice. */
export function characteristicFrom(
  composed: Composed,
  id: string,
  chosen: Readonly<Record<string, string>>,
): Characteristic | undefined {
  const ids = rolesOf(composed).map(({ name }) => chosen[name] ?? "");
  if (ids.includes("") || new Set(ids).size < ids.length) return undefined;
  const [first = "", second = "", third = ""] = ids;
  switch (composed) {
    case "parallelism":
    case "perpendicularity":
      return { id, measure: { type: composed, of: first, to: second } };
    case "distance":
    case "angle":
      return { id, measure: { type: composed, from: first, to: second } };
    case "flush":
      return { id, measure: { type: "flush", reference: first, surface: second } };
    case "gap":
      return { id, measure: { type: "gap", from: first, to: second, surface: third } };
    case "groove_depth":
      return { id, measure: { type: "groove_depth", floor: first, shoulders: [second, third] } };
    case "coordinate_x":
      return { id, measure: { type: "coordinate", of: first, axis: "x" } };
    case "coordinate_y":
      return { id, measure: { type: "coordinate", of: first, axis: "y" } };
    case "coordinate_z":
      return { id, measure: { type: "coordinate", of: first, axis: "z" } };
  }
}
