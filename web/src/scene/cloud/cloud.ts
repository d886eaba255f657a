/**
 * The points of a scan in the format of the GPU: append-only chunks of 16-bit positions.
 *
 * Each block of the stream has its own origin and step. Thousands of draw calls cost more than the points themselves,
 * so blocks are merged into chunks of 2¹⁷ points with a common bounding box; positions are converted to the chunk's
 * step (a few µm). The points of a chunk are distributed over lanes in turn, so that every lane is a subsample of the
 * whole chunk: a moving view draws the first lanes only.
 */

import type { PointsBlock } from "../../stream/protocol";
import type { Vec3 } from "./shapes";

/** Points per chunk: 1.5 MiB, which can be uploaded to the GPU within one frame. */
export const CHUNK_POINTS = 2 ** 17;

/** Number of lanes: the coarsest thinning draws one point in so many. */
export const LANES = 8;

/** 16-bit words per point: x, y, z, intensity, order and σ class, position along the line. */
export const WORDS = 6;

/**
 * Margin around the first block of a chunk, mm: about ten rows of travel. Doubled for the next chunk if it was too
 * small.
 */
const MARGIN_MM = 16;

const STEPS = 65535;

export interface Box {
  min: [number, number, number];
  max: [number, number, number];
}

/** Points of one block within a chunk. */
export interface BlockPart {
  block: number;
  frame: number;
  position_mm: number;
  /** Index of its first point in the chunk. */
  first: number;
  n_points: number;
  box: Box;
}

/** A contiguous range of points in a chunk's buffer. */
export interface DrawRange {
  start: number;
  count: number;
}

function boxOf(block: PointsBlock): Box {
  const { origin_mm, step_mm } = block;
  const far = (axis: 0 | 1 | 2) => origin_mm[axis] + STEPS * step_mm[axis];
  return { min: [...origin_mm], max: [far(0), far(1), far(2)] };
}

/** Extends a box so that it contains another. */
export function widen(box: Box, other: Box): void {
  for (const axis of [0, 1, 2] as const) {
    box.min[axis] = Math.min(box.min[axis], other.min[axis]);
    box.max[axis] = Math.max(box.max[axis], other.max[axis]);
  }
}

export class CloudChunk {
  readonly words = new Uint16Array(WORDS * CHUNK_POINTS);
  readonly origin_mm: Vec3;
  readonly step_mm: Vec3;
  readonly parts: BlockPart[] = [];
  n_points = 0;
  private readonly box: Box;

  constructor(first: Box, margin_mm: number) {
    const min = first.min.map((low) => low - margin_mm) as [number, number, number];
    const max = first.max.map((high) => high + margin_mm) as [number, number, number];
    this.box = { min, max };
    this.origin_mm = min;
    const step = (axis: 0 | 1 | 2) => (max[axis] - min[axis]) / STEPS;
    this.step_mm = [step(0), step(1), step(2)];
  }

  get full(): boolean {
    return this.n_points === CHUNK_POINTS;
  }

  holds(box: Box): boolean {
    const axes = [0, 1, 2] as const;
    return axes.every((axis) => box.min[axis] >= this.box.min[axis] && box.max[axis] <= this.box.max[axis]);
  }

  /** Appends points of a block from `from` on, as many as fit; returns how many. */
  append(block: PointsBlock, box: Box, from: number): number {
    const source = new Uint16Array(block.points.buffer, block.points.byteOffset, WORDS * block.n_points);
    const count = Math.min(block.n_points - from, CHUNK_POINTS - this.n_points);
    const scale = ([0, 1, 2] as const).map((axis) => block.step_mm[axis] / this.step_mm[axis]);
    const shift = ([0, 1, 2] as const).map(
      (axis) => (block.origin_mm[axis] - this.origin_mm[axis]) / this.step_mm[axis] + 0.5,
    );
    const [sx = 0, sy = 0, sz = 0] = scale;
    const [ox = 0, oy = 0, oz = 0] = shift;
    const words = this.words;
    for (let idx = 0; idx < count; idx++) {
      const read = WORDS * (from + idx);
      const write = WORDS * slotOf(this.n_points + idx);
      words[write] = ox + sx * (source[read] as number);
      words[write + 1] = oy + sy * (source[read + 1] as number);
      words[write + 2] = oz + sz * (source[read + 2] as number);
      words[write + 3] = source[read + 3] as number;
      words[write + 4] = source[read + 4] as number;
      words[write + 5] = source[read + 5] as number;
    }
    const { block: number, frame, position_mm } = block;
    this.parts.push({ block: number, frame, position_mm, first: this.n_points, n_points: count, box });
    this.n_points += count;
    return count;
  }

  /** Buffer ranges of the points `from` to `to` (exclusive), one per lane. */
  written(from: number, to: number): DrawRange[] {
    return lanes(LANES, (lane) => {
      const [start, end] = [inLane(from, lane), inLane(to, lane)];
      return { start: lane * LANE + start, count: end - start };
    });
  }

  /** Buffer ranges to draw for one point in `thinning`, a power of two up to `LANES`. */
  drawn(thinning: number): DrawRange[] {
    const wanted = LANES / thinning;
    if (this.full) return [{ start: 0, count: wanted * LANE }];
    return lanes(wanted, (lane) => ({ start: lane * LANE, count: inLane(this.n_points, lane) }));
  }

  /** Position of a point of the chunk, part frame, mm. */
  position(point: number): Vec3 {
    const at = WORDS * slotOf(point);
    const { words, origin_mm, step_mm } = this;
    const coordinate = (axis: 0 | 1 | 2) => origin_mm[axis] + step_mm[axis] * (words[at + axis] as number);
    return [coordinate(0), coordinate(1), coordinate(2)];
  }

  /** All attributes of a point except its position. */
  attributes(point: number): { intensity: number; order: number; sigma_class: number; along_px: number } {
    const at = WORDS * slotOf(point);
    const order_sigma = this.words[at + 4] as number;
    return {
      intensity: this.words[at + 3] as number,
      order: ((order_sigma & 255) << 24) >> 24,
      sigma_class: order_sigma >> 8,
      along_px: this.words[at + 5] as number,
    };
  }

  /** The block to which a point belongs. */
  partOf(point: number): BlockPart | undefined {
    return this.parts.findLast((part) => part.first <= point);
  }
}

const LANE = CHUNK_POINTS / LANES;

function lanes(count: number, range: (lane: number) => DrawRange): DrawRange[] {
  return Array.from({ length: count }, (_, lane) => range(lane)).filter(({ count }) => count > 0);
}

/** How many of a chunk's first `n_points` points are in a lane. */
function inLane(n_points: number, lane: number): number {
  return Math.floor((n_points - lane + LANES - 1) / LANES);
}

/** Index in the buffer of a point of a chunk. */
export function slotOf(point: number): number {
  return (point % LANES) * LANE + Math.floor(point / LANES);
}

/** All points of one scan. */
export class Cloud {
  readonly chunks: CloudChunk[] = [];
  n_points = 0;
  n_blocks = 0;
  /** Bounding box of all points; undefined without points. */
  box: Box | undefined;
  private margin_mm = MARGIN_MM;

  /** Adds a block. */
  append(block: PointsBlock): void {
    this.n_blocks += 1;
    if (block.n_points === 0) return;
    const box = boxOf(block);
    if (this.box) widen(this.box, box);
    else this.box = { min: [...box.min], max: [...box.max] };
    for (let taken = 0; taken < block.n_points; ) taken += this.chunkFor(box).append(block, box, taken);
    this.n_points += block.n_points;
  }

  private chunkFor(box: Box): CloudChunk {
    const last = this.chunks.at(-1);
    if (last && !last.full && last.holds(box)) return last;
    if (last && !last.full) this.margin_mm *= 2;
    const chunk = new CloudChunk(box, this.margin_mm);
    this.chunks.push(chunk);
    return chunk;
  }
}
