/** Fitted shapes, and the deviation of points from them. */

import type { Schemas } from "../../api/client";
import type { DeviationMap } from "./deviation_map";
import type { HeightMap } from "./height_map";

export type Vec3 = readonly [number, number, number];

/** Converts a list of the API to a vector; missing numbers are `NaN`. */
export function vec3([x = Number.NaN, y = Number.NaN, z = Number.NaN]: readonly number[]): Vec3 {
  return [x, y, z];
}

/** A fitted feature, the surface of another scan, or that of a CAD model, in the part frame, mm. */
export type FittedShape =
  | { kind: "plane"; point_mm: Vec3; normal: Vec3 }
  | { kind: "sphere"; centre_mm: Vec3; radius_mm: number }
  | { kind: "cylinder"; point_mm: Vec3; axis: Vec3; radius_mm: number }
  | { kind: "surface"; map: HeightMap }
  | { kind: "model"; map: DeviationMap };

/** Converts the shape of a measurement result. */
export function shapeOf(shape: Schemas["ShapeDto"]): FittedShape {
  switch (shape.kind) {
    case "plane":
      return { ...shape, point_mm: vec3(shape.point_mm), normal: vec3(shape.normal) };
    case "sphere":
      return { ...shape, centre_mm: vec3(shape.centre_mm) };
    case "cylinder":
      return { ...shape, point_mm: vec3(shape.point_mm), axis: vec3(shape.axis) };
  }
}

export function subtract(a: Vec3, b: Vec3): Vec3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

/** a + factor · b. */
export function addScaled(a: Vec3, b: Vec3, factor: number): Vec3 {
  return [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
}

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function distance(a: Vec3, b: Vec3): number {
  return Math.hypot(...subtract(a, b));
}

/** Signed distance of a point, mm: positive on the side of the normal, or outside; `NaN` if unknown. */
export function deviation(shape: FittedShape, at: Vec3): number {
  switch (shape.kind) {
    case "plane":
      return dot(shape.normal, subtract(at, shape.point_mm));
    case "sphere":
      return distance(at, shape.centre_mm) - shape.radius_mm;
    case "surface":
    case "model":
      return shape.map.deviation(at);
    case "cylinder": {
      const from_axis = subtract(at, shape.point_mm);
      const along = dot(shape.axis, from_axis);
      return Math.sqrt(Math.max(0, dot(from_axis, from_axis) - along * along)) - shape.radius_mm;
    }
  }
}
