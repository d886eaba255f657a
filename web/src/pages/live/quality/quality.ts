/** Quality of the lines of a frame for each order. */

import type { Greys } from "../../../scene/image/camera_image";
import { runAlongU } from "../../../scene/image/centreline_layer";
import type { ImageMessage, OrderRange, ProfileMessage } from "../../../stream/protocol";
import { NO_ORDER } from "../../../theme";

/** Number of neighbouring points to which a straight line is fitted. */
export const SEGMENT_POINTS = 21;

/** Grey levels from here on count as full scale, because JPEG rounds. */
const FULL_SCALE_GREY = 253;

export interface OrderQuality {
  order: number;
  n_points: number;
  /** Share of the columns (rows, if lines run along columns) in which the order was detected. */
  coverage: number;
  /** Median grey level at the centre, 0–255. */
  grey: number | undefined;
  /** Share of points whose centre is at full scale. */
  saturated: number | undefined;
  /** Median σ of its points, mm; undefined without a calibration. */
  sigma_mm: number | undefined;
  /** RMS deviation of z from straight lines through `SEGMENT_POINTS` neighbouring points, mm. */
  scatter_mm: number | undefined;
}

/** Quality of all orders in a frame, in ascending order. */
export function qualityOf(
  image: ImageMessage,
  profile: ProfileMessage | undefined,
  greys?: Greys,
): OrderQuality[] {
  const orders = [...new Set(image.lines.map((line) => line.order))].sort((a, b) => a - b);
  // Lines without an order come last.
  if (orders[0] === NO_ORDER) orders.push(...orders.splice(0, 1));
  return orders.map((order) => {
    const range = profile?.orders.find((row) => row.order === order);
    return {
      order,
      ...seenInImage(image, order, greys),
      sigma_mm:
        profile && range ? median(profile.sigma_mm.slice(range.first, range.first + range.n_points)) : undefined,
      scatter_mm: profile && range ? scatter(profile, range) : undefined,
    };
  });
}

function seenInImage(image: ImageMessage, order: number, greys: Greys | undefined) {
  const along_u = runAlongU(image);
  const seen = new Uint8Array(along_u ? image.width_px : image.height_px);
  const centre_greys: number[] = [];
  let [n_points, n_saturated] = [0, 0];
  for (const line of image.lines) {
    if (line.order !== order) continue;
    n_points += line.n_points;
    for (let idx = line.first; idx < line.first + line.n_points; idx++) {
      const column = Math.round((image.points[2 * idx] ?? 0) / image.units_per_px);
      const row = Math.round((image.points[2 * idx + 1] ?? 0) / image.units_per_px);
      seen[along_u ? column : row] = 1;
      const grey = greys && greyAt(greys, image, column, row);
      if (grey === undefined) continue;
      centre_greys.push(grey);
      if (grey >= FULL_SCALE_GREY) n_saturated += 1;
    }
  }
  const coverage = seen.reduce((sum, one) => sum + one, 0) / Math.max(1, seen.length);
  return {
    n_points,
    coverage,
    grey: median(Float32Array.from(centre_greys)),
    saturated: centre_greys.length > 0 ? n_saturated / centre_greys.length : undefined,
  };
}

/** Grey level 0–255 at a position of the frame. */
export function greyAt(greys: Greys, image: ImageMessage, u_px: number, v_px: number): number | undefined {
  const [column, row] = [Math.floor(Math.round(u_px) / image.scale), Math.floor(Math.round(v_px) / image.scale)];
  if (column < 0 || row < 0 || column >= greys.width || row >= greys.height) return undefined;
  return greys.data[4 * (row * greys.width + column)];
}

/** The median; sorts `values` in place. */
function median(values: Float32Array): number | undefined {
  if (values.length === 0) return undefined;
  values.sort();
  const middle = values.length >> 1;
  const upper = values[middle] ?? 0;
  return values.length % 2 === 1 ? upper : (upper + (values[middle - 1] ?? 0)) / 2;
}

/**
 * RMS deviation of z from straight lines fitted to segments of `SEGMENT_POINTS` neighbouring points, with two degrees
 * of freedom subtracted per segment; `undefined` if no segment is without a gap. Includes curvature and texture of
 * the part.
 */
export function scatter(profile: ProfileMessage, range: OrderRange): number | undefined {
  const along = profile.along === "x" ? profile.x_mm : profile.y_mm;
  const end = range.first + range.n_points;
  let [squares, freedom] = [0, 0];
  for (let start = range.first; start + SEGMENT_POINTS <= end; ) {
    const gap = gapIn(profile, start);
    if (gap !== undefined) {
      start = gap;
      continue;
    }
    squares += squaresAboutLine(along, profile.z_mm, start);
    freedom += SEGMENT_POINTS - 2;
    start += SEGMENT_POINTS;
  }
  return freedom > 0 ? Math.sqrt(squares / freedom) : undefined;
}

/** Index after the first gap in the segment that begins at `start`; `undefined` if it has none. */
function gapIn(profile: ProfileMessage, start: number): number | undefined {
  const axis = profile.along === "x" ? 0 : 1;
  for (let idx = start + 1; idx < start + SEGMENT_POINTS; idx++) {
    const step = (profile.pixels[2 * idx + axis] ?? 0) - (profile.pixels[2 * (idx - 1) + axis] ?? 0);
    if (Math.abs(step) > 1.5 * profile.units_per_px) return idx;
  }
  return undefined;
}

function squaresAboutLine(xs: Float32Array, zs: Float32Array, start: number): number {
  let [mean_x, mean_z] = [0, 0];
  for (let idx = start; idx < start + SEGMENT_POINTS; idx++) {
    mean_x += (xs[idx] ?? 0) / SEGMENT_POINTS;
    mean_z += (zs[idx] ?? 0) / SEGMENT_POINTS;
  }
  let [xx, xz, zz] = [0, 0, 0];
  for (let idx = start; idx < start + SEGMENT_POINTS; idx++) {
    const [x, z] = [(xs[idx] ?? 0) - mean_x, (zs[idx] ?? 0) - mean_z];
    xx += x * x;
    xz += x * z;
    zz += z * z;
  }
  return Math.max(0, xx > 0 ? zz - (xz * xz) / xx : zz);
}
