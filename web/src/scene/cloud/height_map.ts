/**
 * The surface of a scan as a plane per cell of a grid over x and y, for its distance from another scan.
 *
 * A plane, not a mean height: the points of a cell are not spread evenly, so that on a slope their mean would be off.
 */

import type { Cloud } from "./cloud";
import type { Vec3 } from "./shapes";

/** Values per cell: height at its centre, slopes along x and y, and 1 if they are known. */
export const CELL_VALUES = 4;

/** Points per cell on average, and the smallest number for a plane. */
const WANTED_POINTS = 40;
const LEAST_POINTS = 8;

/** Smallest cell, mm, and largest number of cells along an axis. */
const LEAST_CELL_MM = 0.3;
const MOST_CELLS = 512;

/** Steeper cells, and cells with points farther from their plane than this fraction of a cell, hold an edge. */
const STEEPEST = 2;
const ROUGHEST_FRACTION = 0.15;

/** Sums over the points of a cell, relative to its centre. */
const SUMS = 10;

export class HeightMap {
  /** `CELL_VALUES` per cell, x first. */
  readonly values: Float32Array;
  readonly origin_mm: readonly [number, number];
  readonly cell_mm: number;
  readonly size: readonly [number, number];

  constructor(cloud: Cloud) {
    const { min, max } = cloud.box ?? { min: [0, 0, 0], max: [1, 1, 1] };
    const [width_mm, height_mm] = [max[0] - min[0], max[1] - min[1]];
    const dense_mm = Math.sqrt((WANTED_POINTS * width_mm * height_mm) / Math.max(1, cloud.n_points));
    this.cell_mm = Math.max(LEAST_CELL_MM, dense_mm, width_mm / MOST_CELLS, height_mm / MOST_CELLS);
    this.origin_mm = [min[0], min[1]];
    const cells = (length_mm: number) => Math.floor(length_mm / this.cell_mm) + 1;
    this.size = [cells(width_mm), cells(height_mm)];
    const sums = this.sum(cloud);
    this.values = new Float32Array((CELL_VALUES * sums.length) / SUMS);
    for (let cell = 0; cell < sums.length / SUMS; cell++) {
      const plane = planeOf(sums.subarray(SUMS * cell, SUMS * (cell + 1)), this.cell_mm);
      if (plane) this.values.set([...plane, 1], CELL_VALUES * cell);
    }
  }

  /** Signed distance of a point from the surface, mm, positive towards the camera; `NaN` where it is unknown. */
  deviation([x, y, z]: Vec3): number {
    const cell = this.cellAt(x, y);
    if (cell === undefined) return Number.NaN;
    const [height = 0, slope_x = 0, slope_y = 0, known] = this.values.subarray(CELL_VALUES * cell);
    if (!known) return Number.NaN;
    const [dx, dy] = this.fromCentre(cell, x, y);
    return (height + slope_x * dx + slope_y * dy - z) / Math.hypot(1, slope_x, slope_y);
  }

  private cellAt(x: number, y: number): number | undefined {
    const column = Math.floor((x - this.origin_mm[0]) / this.cell_mm);
    const row = Math.floor((y - this.origin_mm[1]) / this.cell_mm);
    const inside = column >= 0 && row >= 0 && column < this.size[0] && row < this.size[1];
    return inside ? column + this.size[0] * row : undefined;
  }

  private fromCentre(cell: number, x: number, y: number): [number, number] {
    const [column, row] = [cell % this.size[0], Math.floor(cell / this.size[0])];
    return [
      x - this.origin_mm[0] - (column + 0.5) * this.cell_mm,
      y - this.origin_mm[1] - (row + 0.5) * this.cell_mm,
    ];
  }

  private sum(cloud: Cloud): Float64Array {
    const sums = new Float64Array(SUMS * this.size[0] * this.size[1]);
    for (const chunk of cloud.chunks) {
      for (let point = 0; point < chunk.n_points; point++) {
        const [x, y, z] = chunk.position(point);
        const cell = this.cellAt(x, y);
        if (cell === undefined) continue;
        const [dx, dy] = this.fromCentre(cell, x, y);
        const terms = [1, dx, dy, z, dx * dx, dx * dy, dy * dy, dx * z, dy * z, z * z];
        terms.forEach((term, idx) => {
          const at = SUMS * cell + idx;
          sums[at] = (sums[at] ?? 0) + term;
        });
      }
    }
    return sums;
  }
}

/** Least-squares plane from the sums of a cell; undefined if there is none, or the cell holds an edge. */
function planeOf(sums: Float64Array, cell_mm: number): [number, number, number] | undefined {
  const [n = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0, zz = 0] = sums;
  if (n < LEAST_POINTS) return undefined;
  // Central moments.
  const [mx, my, mz] = [x / n, y / n, z / n];
  const [cxx, cxy, cyy] = [xx / n - mx * mx, xy / n - mx * my, yy / n - my * my];
  const [cxz, cyz, czz] = [xz / n - mx * mz, yz / n - my * mz, zz / n - mz * mz];
  const determinant = cxx * cyy - cxy * cxy;
  // Points of a single line leave the slope across it open.
  if (determinant < (1e-3 * cell_mm * cell_mm) ** 2) return undefined;
  const slope_x = (cyy * cxz - cxy * cyz) / determinant;
  const slope_y = (cxx * cyz - cxy * cxz) / determinant;
  const variance = czz - slope_x * cxz - slope_y * cyz;
  if (Math.hypot(slope_x, slope_y) > STEEPEST || variance > (ROUGHEST_FRACTION * cell_mm) ** 2) return undefined;
  return [mz - slope_x * mx - slope_y * my, slope_x, slope_y];
}
