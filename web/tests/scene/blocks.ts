/** Blocks of points as the server packs them, for tests. */

import { decodeBlocks, type PointsBlock } from "../../src/stream/protocol";

export interface Spec {
  block: number;
  frame: number;
  position_mm: number;
  points: {
    xyz_mm: [number, number, number];
    order: number;
    intensity: number;
    sigma_class: number;
    along_px: number;
  }[];
  scan_id?: string;
}

const SCAN_ID = "01890a5d-ac96-774b-bcce-b302099a8057";

/** The bytes of a block, by the table of `openapi/stream.md`. */
export function blockBytes({ block, frame, position_mm, points, scan_id = SCAN_ID }: Spec): ArrayBuffer {
  const buffer = new ArrayBuffer(64 + 12 * points.length);
  const view = new DataView(buffer);
  view.setUint8(0, 3);
  view.setUint16(2, 64, true);
  view.setUint32(4, block, true);
  const hex = scan_id.replaceAll("-", "");
  for (let byte = 0; byte < 16; byte++) {
    view.setUint8(8 + byte, Number.parseInt(hex.slice(2 * byte, 2 * byte + 2), 16));
  }
  view.setFloat64(24, position_mm, true);
  view.setUint32(32, frame, true);
  view.setUint32(36, points.length, true);
  for (const axis of [0, 1, 2] as const) {
    const values = points.map((point) => point.xyz_mm[axis]);
    const low = Math.fround(Math.min(...values));
    const step = Math.fround((Math.max(...values) - low) / 65535);
    view.setFloat32(40 + 4 * axis, low, true);
    view.setFloat32(52 + 4 * axis, step, true);
    values.forEach((value, idx) => {
      const steps = step > 0 ? Math.min(65535, Math.round((value - low) / step)) : 0;
      view.setUint16(64 + 12 * idx + 2 * axis, steps, true);
    });
  }
  points.forEach((point, idx) => {
    const at = 64 + 12 * idx;
    view.setUint16(at + 6, point.intensity, true);
    view.setInt8(at + 8, point.order);
    view.setUint8(at + 9, point.sigma_class);
    view.setUint16(at + 10, point.along_px, true);
  });
  return buffer;
}

/** A block as the page reads it. */
export function block(spec: Spec): PointsBlock {
  const [decoded] = decodeBlocks(blockBytes(spec));
  if (!decoded) throw new Error("no block");
  return decoded;
}
