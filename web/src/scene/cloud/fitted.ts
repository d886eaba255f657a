/** Features of a plan on the cloud: their shapes in the part frame, a place for their label, and their points. */

import type { Schemas } from "../../api/client";
import type { Box, Cloud } from "./cloud";
import { type Feature, RegionGrid, type SurfaceRegion } from "./region";
import { addScaled, deviation, type FittedShape, subtract, type Vec3, vec3 } from "./shapes";
import { AXES, eachPoint } from "./space";

export type PlanFeature = Schemas["PlanFeatureDto"];
export type Pose = Schemas["PoseDto"];
type PlanRegion = Schemas["PlanRegion"];

/** Points farther from the shape than this multiple of its RMS do not belong to it, but never fewer than this, mm. */
const BAND_RMS = 4;
const LEAST_BAND_MM = 0.02;

/** Cell of a region, mm, and largest number along an axis. */
const CELL_MM = 0.6;
const MOST_CELLS = 160;

/** Towards the camera. */
const TOWARDS: Vec3 = [0, 0, -1];

/** Applies a pose to a point. */
export function moved({ rotation, translation_mm }: Pose, at: Vec3): Vec3 {
  return vec3(AXES.map((axis) => dotRow(rotation[axis], at) + (translation_mm[axis] ?? 0)));
}

/** Applies the rotation of a pose to a direction. */
export function turned({ rotation }: Pose, direction: Vec3): Vec3 {
  return vec3(AXES.map((axis) => dotRow(rotation[axis], direction)));
}

function dotRow(row: readonly number[] | undefined, at: Vec3): number {
  return at.reduce((sum, value, idx) => sum + value * (row?.[idx] ?? 0), 0);
}

export function inverse({ rotation, translation_mm }: Pose): Pose {
  const transposed = AXES.map((row) => AXES.map((column) => rotation[column]?.[row] ?? 0));
  const shift = vec3(translation_mm);
  return { rotation: transposed, translation_mm: AXES.map((axis) => -dotRow(transposed[axis], shift)) };
}

/** The shape of a feature in the part frame; undefined for features without a surface. */
export function shapeInPart(
  { geometry }: PlanFeature,
  part_from_frame: Pose | undefined,
): FittedShape | undefined {
  const at = (point: readonly number[]) => inPart(vec3(point), part_from_frame);
  const along = (direction: readonly number[]) =>
    part_from_frame ? turned(part_from_frame, vec3(direction)) : vec3(direction);
  switch (geometry?.kind) {
    case "plane":
      return { kind: "plane", point_mm: at(geometry.point_mm), normal: along(geometry.normal) };
    case "sphere":
      return { kind: "sphere", centre_mm: at(geometry.centre_mm), radius_mm: geometry.radius_mm };
    case "cylinder":
      return {
        kind: "cylinder",
        point_mm: at(geometry.point_mm),
        axis: along(geometry.axis),
        radius_mm: geometry.radius_mm,
      };
    default:
      return undefined;
  }
}

function inPart(at: Vec3, part_from_frame: Pose | undefined): Vec3 {
  return part_from_frame ? moved(part_from_frame, at) : at;
}

/** Where a feature is labelled, part frame: on its surface, on the side of the camera. */
export function placeOf({ geometry }: PlanFeature, part_from_frame: Pose | undefined): Vec3 | undefined {
  switch (geometry?.kind) {
    case "plane":
    case "line":
      return inPart(vec3(geometry.point_mm), part_from_frame);
    case "circle":
    case "slot":
      return inPart(vec3(geometry.centre_mm), part_from_frame);
    case "point":
      return inPart(vec3(geometry.at_mm), part_from_frame);
    case "sphere":
      return addScaled(inPart(vec3(geometry.centre_mm), part_from_frame), TOWARDS, geometry.radius_mm);
    case "cylinder":
      return addScaled(inPart(vec3(geometry.point_mm), part_from_frame), TOWARDS, geometry.radius_mm);
    default:
      return undefined;
  }
}

/** Whether a point of the frame of the region is inside. */
export function isInRegion(region: PlanRegion, at: Vec3): boolean {
  if (region.type === "box") {
    return AXES.every((axis) => at[axis] >= (region.min_mm[axis] ?? 0) && at[axis] <= (region.max_mm[axis] ?? 0));
  }
  const from = subtract(at, vec3(region.centre_mm));
  if (region.type === "sphere") return Math.hypot(...from) <= region.radius_mm;
  const axis = vec3(region.axis);
  const along = dotRow(axis, from) / Math.hypot(...axis);
  return (
    Math.abs(along) <= region.half_length_mm && Math.hypot(...from) ** 2 - along ** 2 <= region.radius_mm ** 2
  );
}

/** A feature with the cells of its points: those near its shape within its region. */
export function featureOnCloud(
  cloud: Cloud,
  shape: FittedShape,
  rms_mm: number,
  accepts: (at: Vec3) => boolean,
): Feature {
  const band_mm = Math.max(LEAST_BAND_MM, BAND_RMS * rms_mm);
  const box: Box = cloud.box ?? { min: [0, 0, 0], max: [1, 1, 1] };
  const extent = AXES.map((axis) => box.max[axis] - box.min[axis]);
  const cell_mm = Math.max(CELL_MM, ...extent.map((length) => length / MOST_CELLS));
  const size = extent.map((length) => Math.floor(length / cell_mm) + 1);
  const [nx = 1, ny = 1] = size;
  const cells = new Set<number>();
  eachPoint(cloud, (at) => {
    if (Math.abs(deviation(shape, at)) > band_mm || !accepts(at)) return;
    const [x = 0, y = 0, z = 0] = AXES.map((axis) => Math.floor((at[axis] - box.min[axis]) / cell_mm));
    cells.add(x + nx * (y + ny * z));
  });
  const region: SurfaceRegion = { origin_mm: box.min, cell_mm, size, cells: [...cells], band_mm };
  return { shape, grid: new RegionGrid(region) };
}
