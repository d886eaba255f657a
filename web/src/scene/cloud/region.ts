/** The region of a measured feature from the server: cells that contain points of its fit. */

import type { Schemas } from "../../api/client";
import { deviation, type FittedShape, type Vec3, vec3 } from "./shapes";

export type SurfaceRegion = Schemas["SurfaceRegionDto"];

/** The cells as a 3D array of bytes, 255 inside the region; also used as a texture. */
export class RegionGrid {
  readonly bytes: Uint8Array;
  private readonly origin_mm: Vec3;
  /** Cells along x, y, z. */
  readonly size: Vec3;

  constructor(readonly region: SurfaceRegion) {
    this.origin_mm = vec3(region.origin_mm);
    this.size = vec3(region.size);
    const [nx, ny, nz] = this.size;
    this.bytes = new Uint8Array(nx * ny * nz);
    for (const cell of region.cells) this.bytes[cell] = 255;
  }

  /** Whether a position is in one of the cells. */
  holds(at: Vec3): boolean {
    const { origin_mm, size } = this;
    const { cell_mm } = this.region;
    const cell = (axis: 0 | 1 | 2) => Math.floor((at[axis] - origin_mm[axis]) / cell_mm);
    const [x, y, z] = [cell(0), cell(1), cell(2)];
    if (x < 0 || y < 0 || z < 0 || x >= size[0] || y >= size[1] || z >= size[2]) return false;
    return this.bytes[x + size[0] * (y + size[1] * z)] === 255;
  }
}

/** A fitted shape and its region. Without a region every point is part of the feature. */
export interface Feature {
  shape: FittedShape;
  grid?: RegionGrid | undefined;
  /** Deviations up to this get a colour of their own, µm; from the distribution of all if undefined. */
  half_range_um?: number | undefined;
}

/** Signed distance of a point from the shape, mm; `NaN` for points outside the region. */
export function featureDeviation({ shape, grid }: Feature, at: Vec3): number {
  const from_shape = deviation(shape, at);
  if (!grid) return from_shape;
  return Math.abs(from_shape) <= grid.region.band_mm && grid.holds(at) ? from_shape : Number.NaN;
}
