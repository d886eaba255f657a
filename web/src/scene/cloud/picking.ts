/** Finds the point at the pointer by a search over the points in memory. */

import type { Box, Cloud, CloudChunk } from "./cloud";
import { slotOf, WORDS } from "./cloud";
import { type Vec3, vec3 } from "./shapes";

/** A point is picked within this distance of the pointer, CSS pixels. */
const PICK_RADIUS_PX = 9;

/** Among points within this distance of the pointer the frontmost is picked, CSS pixels. */
const SAME_PX = 3;

export interface Picked {
  /** Displayed position, rounded to the step of its chunk. */
  position_mm: Vec3;
  block: number;
  frame: number;
  stage_mm: number;
  order: number;
  sigma_class: number;
  intensity: number;
  along_px: number;
}

/** Column-major 4×4 matrix, clip space from the part frame. */
export type Projection = ArrayLike<number>;

export interface Pointer {
  x_px: number;
  y_px: number;
  width_px: number;
  height_px: number;
}

/** Projects a point of the part frame to CSS pixels and depth (−1 near, 1 far). */
export function project(
  clip: Projection,
  at: Vec3,
  width_px: number,
  height_px: number,
): [number, number, number] {
  const row = (idx: number) =>
    (clip[idx] as number) * at[0] +
    (clip[idx + 4] as number) * at[1] +
    (clip[idx + 8] as number) * at[2] +
    (clip[idx + 12] as number);
  const w = row(3);
  return [((row(0) / w + 1) / 2) * width_px, ((1 - row(1) / w) / 2) * height_px, row(2) / w];
}

/** The point at the pointer, ignoring `hidden` ones. */
export function pick(
  cloud: Cloud,
  clip: Projection,
  pointer: Pointer,
  hidden?: (chunk: CloudChunk, point: number) => boolean,
): Picked | undefined {
  let best: { chunk: CloudChunk; point: number; off_px: number; depth: number } | undefined;
  for (const chunk of cloud.chunks) {
    const near = chunkSearch(chunk, clip, pointer, hidden);
    if (near && (!best || nearer(near, best))) best = { chunk, ...near };
  }
  return best && pickedPoint(best.chunk, best.point);
}

interface Candidate {
  off_px: number;
  depth: number;
}

/** Whether `a` is the better candidate: the one in front if both are close to the pointer, else the closer one. */
function nearer(a: Candidate, b: Candidate): boolean {
  const [near_a, near_b] = [a.off_px <= SAME_PX, b.off_px <= SAME_PX];
  if (near_a && near_b) return a.depth < b.depth;
  return near_a !== near_b ? near_a : a.off_px < b.off_px;
}

function chunkSearch(
  chunk: CloudChunk,
  clip: Projection,
  pointer: Pointer,
  hidden?: (chunk: CloudChunk, point: number) => boolean,
): (Candidate & { point: number }) | undefined {
  const matrix = chunkMatrix(clip, chunk);
  const [m0, m1, m3, m4, m5, m7, m8, m9, m11, m12, m13, m15] = [0, 1, 3, 4, 5, 7, 8, 9, 11, 12, 13, 15].map(
    (idx) => matrix[idx] as number,
  ) as [number, number, number, number, number, number, number, number, number, number, number, number];
  const { width_px, height_px } = pointer;
  const words = chunk.words;
  let best: (Candidate & { point: number }) | undefined;
  for (const part of chunk.parts) {
    if (!isNearPointer(part.box, clip, pointer)) continue;
    const end = part.first + part.n_points;
    for (let point = part.first; point < end; point++) {
      const at = WORDS * slotOf(point);
      const [x, y, z] = [words[at] as number, words[at + 1] as number, words[at + 2] as number];
      const w = m3 * x + m7 * y + m11 * z + m15;
      const right_px = (((m0 * x + m4 * y + m8 * z + m12) / w + 1) / 2) * width_px - pointer.x_px;
      if (Math.abs(right_px) > PICK_RADIUS_PX) continue;
      const down_px = ((1 - (m1 * x + m5 * y + m9 * z + m13) / w) / 2) * height_px - pointer.y_px;
      const off_px = Math.hypot(right_px, down_px);
      if (off_px > PICK_RADIUS_PX) continue;
      const depth =
        ((matrix[2] as number) * x +
          (matrix[6] as number) * y +
          (matrix[10] as number) * z +
          (matrix[14] as number)) /
        w;
      if (depth < -1 || depth > 1 || hidden?.(chunk, point)) continue;
      if (!best || nearer({ off_px, depth }, best)) best = { point, off_px, depth };
    }
  }
  return best;
}

/** Clip space from the 16-bit positions of a chunk. */
function chunkMatrix(clip: Projection, chunk: CloudChunk): number[] {
  const matrix = Array.from({ length: 16 }, (_, idx) => clip[idx] as number);
  for (let row = 0; row < 4; row++) {
    let shift = matrix[12 + row] as number;
    for (const axis of [0, 1, 2] as const) {
      shift += (matrix[4 * axis + row] as number) * chunk.origin_mm[axis];
      matrix[4 * axis + row] = (matrix[4 * axis + row] as number) * chunk.step_mm[axis];
    }
    matrix[12 + row] = shift;
  }
  return matrix;
}

/** Whether the projection of a box is near the pointer. */
function isNearPointer(box: Box, clip: Projection, { x_px, y_px, width_px, height_px }: Pointer): boolean {
  const bounds = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY, -1e30];
  for (let corner = 0; corner < 8; corner++) {
    const at = ([0, 1, 2] as const).map((axis) => ((corner >> axis) & 1 ? box.max[axis] : box.min[axis]));
    const [x, y] = project(clip, vec3(at), width_px, height_px);
    bounds[0] = Math.min(bounds[0] as number, x);
    bounds[1] = Math.min(bounds[1] as number, y);
    bounds[2] = Math.max(bounds[2] as number, x);
    bounds[3] = Math.max(bounds[3] as number, y);
  }
  const [left = 0, top = 0, right = 0, bottom = 0] = bounds;
  const across = x_px >= left - PICK_RADIUS_PX && x_px <= right + PICK_RADIUS_PX;
  return across && y_px >= top - PICK_RADIUS_PX && y_px <= bottom + PICK_RADIUS_PX;
}

function pickedPoint(chunk: CloudChunk, point: number): Picked | undefined {
  const part = chunk.partOf(point);
  if (!part) return undefined;
  return {
    position_mm: chunk.position(point),
    block: part.block,
    frame: part.frame,
    stage_mm: part.position_mm,
    ...chunk.attributes(point),
  };
}
