/**
 * Where the viewer stands: on a sphere around a target, in perspective or parallel projection.
 *
 * The part frame has x to the right and y down in the picture, z away from the camera. Here "up" is towards the camera
 * (−z) and "front" is the lower edge of the picture (+y).
 */

import { Matrix4, OrthographicCamera, PerspectiveCamera, Vector3 } from "three";
import type { Box } from "./cloud";

export type ViewName = "front" | "top" | "side" | "iso";

const RIGHT = new Vector3(1, 0, 0);
const FRONT = new Vector3(0, 1, 0);
const UP = new Vector3(0, 0, -1);

const DEGREE = Math.PI / 180;

/** Azimuth around the up axis from the front, elevation over the horizon. */
const VIEWS: Record<ViewName, readonly [number, number]> = {
  front: [0, 0],
  top: [0, 90 * DEGREE],
  side: [90 * DEGREE, 0],
  iso: [32 * DEGREE, 38 * DEGREE],
};

/** Height of the field of view in perspective. */
const FIELD_RAD = 32 * DEGREE;

/** Room around what is fitted, as a factor. */
const FIT_ROOM = 1.06;

/** Nearest and farthest distance of the eye to its target, mm. */
const NEAREST_MM = 0.5;
const FARTHEST_MM = 20_000;

export class Orbit {
  readonly target = new Vector3();
  azimuth_rad = VIEWS.iso[0];
  elevation_rad = VIEWS.iso[1];
  distance_mm = 300;
  orthographic = false;
  private readonly perspective = new PerspectiveCamera(FIELD_RAD / DEGREE);
  private readonly parallel = new OrthographicCamera();
  private aspect = 1;
  private reach_mm = 100;

  /** Half of what is seen at the target, across the height of the view, mm. */
  get half_height_mm(): number {
    return this.distance_mm * Math.tan(FIELD_RAD / 2);
  }

  /** The unit vectors of the view: to the right, up, and towards the eye. */
  basis(): { right: Vector3; up: Vector3; back: Vector3 } {
    const [sin_a, cos_a] = [Math.sin(this.azimuth_rad), Math.cos(this.azimuth_rad)];
    const [sin_e, cos_e] = [Math.sin(this.elevation_rad), Math.cos(this.elevation_rad)];
    const level = FRONT.clone().multiplyScalar(cos_a).addScaledVector(RIGHT, sin_a);
    const right = RIGHT.clone().multiplyScalar(cos_a).addScaledVector(FRONT, -sin_a);
    const up = level.clone().multiplyScalar(-sin_e).addScaledVector(UP, cos_e);
    const back = level.multiplyScalar(cos_e).addScaledVector(UP, sin_e);
    return { right, up, back };
  }

  /** The camera that stands there. */
  camera(): PerspectiveCamera | OrthographicCamera {
    const camera = this.orthographic ? this.parallel : this.perspective;
    const { right, up, back } = this.basis();
    camera.position.copy(this.target).addScaledVector(back, this.distance_mm);
    camera.quaternion.setFromRotationMatrix(new Matrix4().makeBasis(right, up, back));
    camera.near = Math.max(this.distance_mm / 100, this.distance_mm - 4 * this.reach_mm);
    camera.far = this.distance_mm + 4 * this.reach_mm;
    const half = this.half_height_mm;
    this.perspective.aspect = this.aspect;
    this.parallel.top = half;
    this.parallel.bottom = -half;
    this.parallel.right = half * this.aspect;
    this.parallel.left = -half * this.aspect;
    // Parallel rays come from anywhere: nothing is behind the eye.
    if (this.orthographic) camera.near = this.distance_mm - 4 * this.reach_mm;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    return camera;
  }

  resize(aspect: number): void {
    this.aspect = aspect;
  }

  /** Looks from a standard direction. */
  view(name: ViewName): void {
    [this.azimuth_rad, this.elevation_rad] = VIEWS[name];
  }

  /** Goes so far away that the whole box is seen, from the present direction. */
  fit(box: Box): void {
    const corner = (at: number) =>
      new Vector3(...([0, 1, 2] as const).map((axis) => ((at >> axis) & 1 ? box.max[axis] : box.min[axis])));
    const corners = Array.from({ length: 8 }, (_, at) => corner(at));
    const centre = corner(0).add(corner(7)).multiplyScalar(0.5);
    this.target.copy(centre);
    this.reach_mm = Math.max(1, centre.distanceTo(corner(0)));
    const { right, up, back } = this.basis();
    const slope = Math.tan(FIELD_RAD / 2) / FIT_ROOM;
    const distances = corners.map((corner) => {
      const from = corner.sub(centre);
      const across = Math.max(Math.abs(from.dot(up)), Math.abs(from.dot(right)) / this.aspect);
      return across / slope + (this.orthographic ? 0 : from.dot(back));
    });
    this.distance_mm = clamp(Math.max(...distances), NEAREST_MM, FARTHEST_MM);
  }

  /** Turns around the target. */
  turn(azimuth_rad: number, elevation_rad: number): void {
    this.azimuth_rad += azimuth_rad;
    this.elevation_rad = clamp(this.elevation_rad + elevation_rad, -90 * DEGREE, 90 * DEGREE);
  }

  /** Moves the target across the view, in shares of the view's height. */
  pan(right: number, up: number): void {
    const basis = this.basis();
    this.target.addScaledVector(basis.right, 2 * this.half_height_mm * right);
    this.target.addScaledVector(basis.up, 2 * this.half_height_mm * up);
  }

  /** Goes nearer (factor below 1) towards a place of the view, in half heights from its centre. */
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
