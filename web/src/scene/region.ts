/** Which points belong to a measured feature, as the server says: cells of space that hold points of its fit. */

import { deviation, type FittedShape, type Vec3 } from "./shapes";

/** As the result of a measurement writes it. */
export interface SurfaceRegion {
  /** Lowest corner of the first cell, part frame, mm. */
  origin_mm: Vec3;
  /** Edge of a cell, mm. */
  cell_mm: number;
  /** Cells along x, y, z. */
  size: Vec3;
  /** Numbers of the cells with points: x + size_x · (y + size_y · z). */
  cells: readonly number[];
  /** Largest distance from the fitted shape of a point that belongs, mm. */
  band_mm: number;
}

/** The cells as a block of bytes, 255 where points belong: for the graphics card, too. */
export class RegionGrid {
  readonly bytes: Uint8Array;

  constructor(readonly region: SurfaceRegion) {
    const [nx, ny, nz] = region.size;
    this.bytes = new Uint8Array(nx * ny * nz);
    for (const cell of region.cells) this.bytes[cell] = 255;
  }

  /** Whether a place lies in one of the cells. */
  holds(at: Vec3): boolean {
    const { origin_mm, cell_mm, size } = this.region;
    const cell = (axis: 0 | 1 | 2) => Math.floor((at[axis] - origin_mm[axis]) / cell_mm);
    const [x, y, z] = [cell(0), cell(1), cell(2)];
    if (x < 0 || y < 0 || z < 0 || x >= size[0] || y >= size[1] || z >= size[2]) return false;
    return this.bytes[x + size[0] * (y + size[1] * z)] === 255;
  }
}

/** A fitted shape, and where it has points. Without a region every point is taken for one of its own. */
export interface Feature {
  shape: FittedShape;
  grid?: RegionGrid | undefined;
}

/** Signed distance of a point of the feature, mm; `NaN` for points that are not of it. */
export function featureDeviation({ shape, grid }: Feature, at: Vec3): number {
  const from_shape = deviation(shape, at);
  if (!grid) return from_shape;
  return Math.abs(from_shape) <= grid.region.band_mm && grid.holds(at) ? from_shape : Number.NaN;
}
