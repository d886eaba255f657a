/**
 * An orbit camera around a target, with perspective or orthographic projection.
 *
 * In the part frame, x points to the right and y down in the camera image, z away from the camera. Here "up" is towards
 * the camera (−z), and "front" is the lower edge of the image (+y). With `z_up` both are opposite.
 */

import type { Box } from "../cloud/cloud";
import { addScaled, distance, dot, subtract, type Vec3 } from "../cloud/shapes";

export type ViewName = "front" | "top" | "side" | "iso";

const DEGREE = Math.PI / 180;

/** Azimuth around the up axis from the front, elevation over the horizon. */
const VIEWS: Record<ViewName, readonly [number, number]> = {
  front: [0, 0],
  top: [0, 90 * DEGREE],
  side: [90 * DEGREE, 0],
  iso: [32 * DEGREE, 38 * DEGREE],
};

/** Vertical field of view in perspective. */
const FIELD_RAD = 32 * DEGREE;

/** Margin around a fitted box, as a factor. */
const FIT_ROOM = 1.06;

/** Smallest and largest distance of the eye from the target, mm. */
const NEAREST_MM = 0.5;
const FARTHEST_MM = 20_000;

export class Orbit {
  target: Vec3 = [0, 0, 0];
  azimuth_rad = VIEWS.iso[0];
  elevation_rad = VIEWS.iso[1];
  distance_mm = 300;
  orthographic = false;
  /** Whether z points upwards, for parts whose z axis points away from the table. */
  z_up = false;
  private aspect = 1;
  private radius_mm = 100;

  /** Half of the visible height at the target, mm. */
  get half_height_mm(): number {
    return this.distance_mm * Math.tan(FIELD_RAD / 2);
  }

  /** The unit vectors of the view: to the right, up, and towards the eye. */
  basis(): { right: Vec3; up: Vec3; back: Vec3 } {
    const [sin_a, cos_a] = [Math.sin(this.azimuth_rad), Math.cos(this.azimuth_rad)];
    const [sin_e, cos_e] = [Math.sin(this.elevation_rad), Math.cos(this.elevation_rad)];
    // Turned by half a turn about x.
    const turned = this.z_up ? -1 : 1;
    return {
      right: [cos_a, -sin_a * turned, 0],
      up: [-sin_e * sin_a, -sin_e * cos_a * turned, -cos_e * turned],
      back: [cos_e * sin_a, cos_e * cos_a * turned, -sin_e * turned],
    };
  }

  /** Clip space from the part frame: a column-major 4×4 OpenGL matrix. */
  clip(): number[] {
    const { right, up, back } = this.basis();
    const eye = addScaled(this.target, back, this.distance_mm);
    const far = this.distance_mm + 4 * this.radius_mm;
    // In orthographic projection nothing is behind the eye.
    const before = this.distance_mm - 4 * this.radius_mm;
    const near = this.orthographic ? before : Math.max(this.distance_mm / 100, before);
    const depth = far - near;
    const row = (axis: Vec3, factor: number, offset = 0) => [
      ...axis.map((component) => factor * component),
      offset - factor * dot(axis, eye),
    ];
    const zoom = (this.orthographic ? 1 : this.distance_mm) / this.half_height_mm;
    const rows = [
      row(right, zoom / this.aspect),
      row(up, zoom),
      ...(this.orthographic
        ? [row(back, -2 / depth, -(far + near) / depth), [0, 0, 0, 1]]
        : [row(back, -(far + near) / depth, (-2 * far * near) / depth), row(back, -1)]),
    ];
    return [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column] ?? 0));
  }

  resize(aspect: number): void {
    this.aspect = aspect;
  }

  /** Sets a standard view direction. */
  view(name: ViewName): void {
    [this.azimuth_rad, this.elevation_rad] = VIEWS[name];
  }

  /** Fits a box into the view without changing the direction. */
  fit(box: Box): void {
    const corners = Array.from({ length: 8 }, (_, at): Vec3 => {
      const side = (axis: 0 | 1 | 2) => ((at >> axis) & 1 ? box.max : box.min)[axis];
      return [side(0), side(1), side(2)];
    });
    const centre = addScaled(box.min, subtract(box.max, box.min), 0.5);
    this.target = centre;
    this.radius_mm = Math.max(1, distance(centre, box.min));
    const { right, up, back } = this.basis();
    const slope = Math.tan(FIELD_RAD / 2) / FIT_ROOM;
    const distances = corners.map((corner) => {
      const from = subtract(corner, centre);
      const across = Math.max(Math.abs(dot(from, up)), Math.abs(dot(from, right)) / this.aspect);
      return across / slope + (this.orthographic ? 0 : dot(from, back));
    });
    this.distance_mm = clamp(Math.max(...distances), NEAREST_MM, FARTHEST_MM);
  }

  /** Rotates around the target. */
  turn(azimuth_rad: number, elevation_rad: number): void {
    this.azimuth_rad += azimuth_rad;
    this.elevation_rad = clamp(this.elevation_rad + elevation_rad, -90 * DEGREE, 90 * DEGREE);
  }

  /** Pans, in shares of the view's height. */
  pan(right: number, up: number): void {
    const basis = this.basis();
    const height_mm = 2 * this.half_height_mm;
    this.target = addScaled(addScaled(this.target, basis.right, height_mm * right), basis.up, height_mm * up);
  }

  /** Zooms (factor below 1: in) towards a position of the view, in half heights from its centre. */
  zoom(factor: number, right = 0, up = 0): void {
    const before = this.distance_mm;
    this.distance_mm = clamp(before * factor, NEAREST_MM, FARTHEST_MM);
    const moved = (1 - this.distance_mm / before) / 2;
    const shown = before / this.distance_mm;
    this.pan(right * moved * shown, up * moved * shown);
  }
}

function clamp(value: number, min: number, max: number): number {
  return Math.min(max, Math.max(min, value));
}
