/** Features of a plan in another frame: what has a place or a direction is moved. */

import type { Schemas } from "../../../api/client";
import type { Box } from "../../../scene/cloud/cloud";
import { moved, type Pose, turned } from "../../../scene/cloud/fitted";
import { type Vec3, vec3 } from "../../../scene/cloud/shapes";
import { AXES } from "../../../scene/cloud/space";
import { featuresBelow } from "../../viewer/plan_on_cloud";
import { type Plan, type PlanFeature, rounded } from "../draft";

export type Alignment = Schemas["PlanAlignment"];

/** Moves what is given by numbers: regions, directions, contours. Boxes become the axis-aligned boxes around them. */
export function inFrame(feature: PlanFeature, pose: Pose): PlanFeature {
  const { shape } = feature;
  if (shape.type === "line" || shape.type === "point") return feature;
  const at = (point_mm: readonly number[]) => [...moved(pose, vec3(point_mm))];
  const along = (direction: readonly number[]) => [...turned(pose, vec3(direction))];
  const { region, facing } = shape.select ?? {};
  const select = shape.select && {
    ...shape.select,
    ...(region && { region: regionIn(region, pose) }),
    ...(facing && { facing: { ...facing, normal: along(facing.normal) } }),
  };
  const selected = select && { select };
  if (shape.type !== "section") return { ...feature, shape: { ...shape, ...selected } };
  const contour = { origin_mm: at(shape.origin_mm), x: along(shape.x), y: along(shape.y) };
  return { ...feature, shape: { ...shape, ...contour, ...selected } };
}

function regionIn(region: Schemas["PlanRegion"], pose: Pose): Schemas["PlanRegion"] {
  if (region.type === "box") {
    const { min, max } = boxIn({ min: vec3(region.min_mm), max: vec3(region.max_mm) }, pose);
    return { type: "box", min_mm: min.map(rounded), max_mm: max.map(rounded) };
  }
  const centre_mm = [...moved(pose, vec3(region.centre_mm))];
  if (region.type === "sphere") return { ...region, centre_mm };
  return { ...region, centre_mm, axis: [...turned(pose, vec3(region.axis))] };
}

/** The axis-aligned box, in the other frame, around a box. */
export function boxIn({ min, max }: { min: Vec3; max: Vec3 }, pose: Pose): Box {
  const found: Box = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };
  for (let corner = 0; corner < 8; corner++) {
    const at = moved(pose, vec3(AXES.map((axis) => ((corner >> axis) & 1 ? max : min)[axis])));
    for (const axis of AXES) {
      found.min[axis] = Math.min(found.min[axis], at[axis]);
      found.max[axis] = Math.max(found.max[axis], at[axis]);
    }
  }
  return found;
}

/** A plan with another alignment, or without; `move` moves the features that the alignment does not depend on. */
export function withAlignment(
  plan: Plan,
  alignment: Alignment | undefined,
  move: (feature: PlanFeature) => PlanFeature,
): Plan {
  const { alignment: before, ...rest } = plan;
  const fixed = featuresBelow(plan, alignment ?? before);
  const features = plan.features.map((one) => (fixed.has(one.id) ? one : move(one)));
  return { ...rest, features, ...(alignment && { alignment }) };
}

/** Whether another plan has the features of an alignment, too, and what they depend on. */
export function hasDatums(plan: Plan, alignment: Alignment, other: Plan): boolean {
  const datums = featuresBelow(plan, alignment);
  return plan.features.every((one) => !datums.has(one.id) || other.features.includes(one));
}
