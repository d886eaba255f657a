/**
 * The deviations of a scan from a CAD model, as a mean per cell of a grid.
 *
 * The server compares a selection of the points, without the numbers that the displayed points have, so that the two
 * cannot be matched one by one. A cell is about as large as the distance of two rows; its mean has less noise.
 */

import type { Vec3 } from "./shapes";
import { AXES, type Axis } from "./space";

/** Values per point: x, y, z in the frame of the scan, deviation, its standard uncertainty; mm. */
const VALUES = 5;

/** Smallest cell, mm, and the largest numbers of cells along an axis and in total: 16 MB on the graphics card. */
const LEAST_CELL_MM = 0.4;
const MOST_ALONG = 256;
const MOST_CELLS = 4_000_000;

/** The value of cells without a known deviation: far outside any range, also after conversion to µm. */
const UNKNOWN_MM = 2e6;

/** Smallest growth of cells that are too many. */
const GROWTH = 1.05;

/** Decodes a response of `POST …/deviations`; throws if it does not consist of whole points. */
export function decodeDeviations(buffer: ArrayBuffer): Float32Array {
  const bytes_per_point = VALUES * Float32Array.BYTES_PER_ELEMENT;
  if (buffer.byteLength % bytes_per_point !== 0) {
    throw new RangeError(`${buffer.byteLength} bytes are not a whole number of points`);
  }
  return new Float32Array(buffer);
}

export class DeviationMap {
  /** Mean deviation per cell, mm, x first; also used as a texture. */
  readonly values: Float32Array;
  readonly origin_mm: Vec3;
  readonly cell_mm: number;
  /** Cells along x, y, z. */
  readonly size: Vec3;

  /** `rows`: from `decodeDeviations`. */
  constructor(rows: Float32Array) {
    const { min, max } = compared(rows);
    this.origin_mm = min;
    this.cell_mm = cellOf(min, max);
    this.size = sizeOf(min, max, this.cell_mm);
    this.values = new Float32Array(this.size[0] * this.size[1] * this.size[2]);
    const empty = this.fillWithMeans(rows);
    this.fillEmpty(empty);
  }

  /** Signed deviation at a point of the scan, mm, positive outside the model; `NaN` if it is unknown. */
  deviation(at: Vec3): number {
    const value = this.values[this.cellAt(...at)] ?? UNKNOWN_MM;
    return value < UNKNOWN_MM ? value : Number.NaN;
  }

  /** Index of a cell; -1 outside the grid. */
  private cellAt(x: number, y: number, z: number): number {
    const { origin_mm, cell_mm, size } = this;
    const column = Math.floor((x - origin_mm[0]) / cell_mm);
    const row = Math.floor((y - origin_mm[1]) / cell_mm);
    const layer = Math.floor((z - origin_mm[2]) / cell_mm);
    const inside = column >= 0 && row >= 0 && layer >= 0 && column < size[0] && row < size[1] && layer < size[2];
    return inside ? column + size[0] * (row + size[1] * layer) : -1;
  }

  /** Sets the cells that have points; returns 1 for those without any. */
  private fillWithMeans(rows: Float32Array): Uint8Array {
    const { values } = this;
    const n_compared = new Uint32Array(values.length);
    const n_beyond = new Uint32Array(values.length);
    for (let at = 0; at + VALUES <= rows.length; at += VALUES) {
      const deviation_mm = rows[at + 3] ?? Number.NaN;
      const cell = this.cellAt(rows[at] ?? 0, rows[at + 1] ?? 0, rows[at + 2] ?? 0);
      if (cell < 0) continue;
      const counts = Number.isNaN(deviation_mm) ? n_beyond : n_compared;
      counts[cell] = (counts[cell] ?? 0) + 1;
      if (counts === n_compared) values[cell] = (values[cell] ?? 0) + deviation_mm;
    }
    const empty = new Uint8Array(values.length);
    for (let cell = 0; cell < values.length; cell++) {
      const [n = 0, beyond = 0] = [n_compared[cell], n_beyond[cell]];
      // Most points of the cell belong to something else.
      values[cell] = n > 0 && n >= beyond ? (values[cell] ?? 0) / n : UNKNOWN_MM;
      empty[cell] = Number(n + beyond === 0);
    }
    return empty;
  }

  /** Cells without points take the mean of their neighbours: the displayed points may be denser than the compared. */
  private fillEmpty(empty: Uint8Array): void {
    const [nx, ny, nz] = this.size;
    const known = this.values.slice();
    const steps = [-1, 0, 1];
    const neighbours = steps.flatMap((dz) => steps.flatMap((dy) => steps.map((dx) => [dx, dy, dz] as const)));
    const sums = new Map<number, { sum_mm: number; n: number }>();
    for (let cell = 0; cell < known.length; cell++) {
      const value = known[cell] ?? UNKNOWN_MM;
      if (value >= UNKNOWN_MM) continue;
      const [x, y, z] = [cell % nx, Math.floor(cell / nx) % ny, Math.floor(cell / (nx * ny))];
      for (const [dx, dy, dz] of neighbours) {
        const [column, row, layer] = [x + dx, y + dy, z + dz];
        if (column < 0 || row < 0 || layer < 0 || column >= nx || row >= ny || layer >= nz) continue;
        const other = column + nx * (row + ny * layer);
        if (!empty[other]) continue;
        const { sum_mm, n } = sums.get(other) ?? { sum_mm: 0, n: 0 };
        sums.set(other, { sum_mm: sum_mm + value, n: n + 1 });
      }
    }
    for (const [cell, { sum_mm, n }] of sums) this.values[cell] = sum_mm / n;
  }
}

/** The box around the points that have a deviation. */
function compared(rows: Float32Array): { min: Vec3; max: Vec3 } {
  const min: [number, number, number] = [Infinity, Infinity, Infinity];
  const max: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  for (let at = 0; at + VALUES <= rows.length; at += VALUES) {
    if (Number.isNaN(rows[at + 3])) continue;
    for (const axis of AXES) {
      min[axis] = Math.min(min[axis], rows[at + axis] ?? 0);
      max[axis] = Math.max(max[axis], rows[at + axis] ?? 0);
    }
  }
  return min[0] <= max[0] ? { min, max } : { min: [0, 0, 0], max: [0, 0, 0] };
}

function cellOf(min: Vec3, max: Vec3): number {
  const along = AXES.map((axis) => (max[axis] - min[axis]) / (MOST_ALONG - 1));
  let cell_mm = Math.max(LEAST_CELL_MM, ...along);
  for (;;) {
    const [nx, ny, nz] = sizeOf(min, max, cell_mm);
    if (nx * ny * nz <= MOST_CELLS) return cell_mm;
    cell_mm *= GROWTH;
  }
}

function sizeOf(min: Vec3, max: Vec3, cell_mm: number): Vec3 {
  const cells = (axis: Axis) => Math.floor((max[axis] - min[axis]) / cell_mm) + 1;
  return [cells(0), cells(1), cells(2)];
}
