/**
 * The binary messages of `sheaf.v1`, specified in `openapi/stream.md`. Arrays are views into the message, not copies.
 */

/** Fields common to opcodes 1 and 2. */
export interface FrameHeader {
  number: number;
  sequence: number;
  /** Middle of the exposure on the station's clock, ms. */
  captured_ms: number;
  position_mm: number;
  laser_on: boolean;
  calibrated: boolean;
}

/** A line detected in an image. */
export interface Line {
  order: number;
  saturated: boolean;
  /** Index of its first point. */
  first: number;
  n_points: number;
}

/** Opcode 1: an image with the centrelines of the same frame. */
export interface ImageMessage extends FrameHeader {
  kind: "image";
  width_px: number;
  height_px: number;
  jpeg_width_px: number;
  jpeg_height_px: number;
  scale: number;
  bit_depth: number;
  exposure_us: number;
  n_saturated: number;
  /** Histogram: pixel counts of 64 equal bins up to full scale. */
  histogram: Uint32Array;
  lines: Line[];
  /** u and v of all points, interleaved, in 1/`units_per_px` pixels. */
  points: Uint16Array;
  units_per_px: number;
  jpeg: Uint8Array<ArrayBuffer>;
}

/** The points of one diffraction order in a profile. */
export interface OrderRange {
  order: number;
  first: number;
  n_points: number;
}

/** Opcode 2: the profile of a frame in the camera frame. */
export interface ProfileMessage extends FrameHeader {
  kind: "profile";
  along: "x" | "y";
  n_left_out: number;
  n_lines: number;
  width_px: number;
  height_px: number;
  units_per_px: number;
  orders: OrderRange[];
  x_mm: Float32Array;
  y_mm: Float32Array;
  z_mm: Float32Array;
  sigma_mm: Float32Array;
  /** u and v, interleaved, in 1/`units_per_px` pixels. */
  pixels: Uint16Array;
}

/** Opcode 3: display points of one frame of a scan, in the part frame. */
export interface PointsBlock {
  kind: "points";
  block: number;
  scan_id: string;
  position_mm: number;
  frame: number;
  n_points: number;
  origin_mm: readonly [number, number, number];
  step_mm: readonly [number, number, number];
  /** 12 bytes per point: x, y, z u16, intensity u16, order i8, sigma class u8, along u16. */
  points: Uint8Array;
  /** Length of the whole block. */
  size_bytes: number;
}

export type BinaryMessage = ImageMessage | ProfileMessage | PointsBlock;

export const BYTES_PER_POINT = 12;

/** σ of a display point, mm; NaN where it is unknown. */
export function sigmaOfClass(sigma_class: number): number {
  return sigma_class === 255 ? Number.NaN : 1e-4 * 2 ** (sigma_class / 16);
}

/** Decodes a binary message; `undefined` if its opcode is unknown. */
export function decode(buffer: ArrayBuffer): BinaryMessage | undefined {
  const view = new DataView(buffer);
  switch (view.getUint8(0)) {
    case 1:
      return decodeImage(buffer, view);
    case 2:
      return decodeProfile(buffer, view);
    case 3:
      return decodePoints(buffer, 0);
    default:
      return undefined;
  }
}

/** Decodes concatenated blocks of points, the response of `GET …/points`. */
export function decodeBlocks(buffer: ArrayBuffer): PointsBlock[] {
  const blocks: PointsBlock[] = [];
  for (let at = 0; at < buffer.byteLength; ) {
    const block = decodePoints(buffer, at);
    blocks.push(block);
    at += block.size_bytes;
  }
  return blocks;
}

function frameHeader(view: DataView): FrameHeader {
  const flags = view.getUint8(1);
  return {
    number: view.getUint32(4, true),
    sequence: Number(view.getBigUint64(8, true)),
    captured_ms: Number(view.getBigUint64(16, true)) / 1e6,
    position_mm: view.getFloat64(24, true),
    laser_on: (flags & 1) !== 0,
    calibrated: (flags & 2) !== 0,
  };
}

function decodeImage(buffer: ArrayBuffer, view: DataView): ImageMessage {
  const header_bytes = view.getUint16(2, true);
  const jpeg_bytes = view.getUint32(40, true);
  const n_lines = view.getUint32(44, true);
  const n_points = view.getUint32(48, true);
  const points_at = header_bytes + 8 * n_lines;
  const lines: Line[] = [];
  for (let row = 0, first = 0; row < n_lines; row++) {
    const at = header_bytes + 8 * row;
    const line = {
      order: view.getInt8(at),
      saturated: (view.getUint8(at + 1) & 1) !== 0,
      first,
      n_points: view.getUint32(at + 4, true),
    };
    lines.push(line);
    first += line.n_points;
  }
  return {
    kind: "image",
    ...frameHeader(view),
    width_px: view.getUint16(32, true),
    height_px: view.getUint16(34, true),
    jpeg_width_px: view.getUint16(36, true),
    jpeg_height_px: view.getUint16(38, true),
    units_per_px: view.getUint16(52, true),
    scale: view.getUint8(54),
    bit_depth: view.getUint8(55),
    exposure_us: view.getFloat32(56, true),
    n_saturated: view.getUint32(60, true),
    histogram: new Uint32Array(buffer, 64, 64),
    lines,
    points: new Uint16Array(buffer, points_at, 2 * n_points),
    jpeg: new Uint8Array(buffer, points_at + 4 * n_points, jpeg_bytes),
  };
}

function decodeProfile(buffer: ArrayBuffer, view: DataView): ProfileMessage {
  const header_bytes = view.getUint16(2, true);
  const n_points = view.getUint32(40, true);
  const n_orders = view.getUint16(44, true);
  const orders = Array.from({ length: n_orders }, (_, row) => {
    const at = header_bytes + 12 * row;
    return {
      order: view.getInt8(at),
      first: view.getUint32(at + 4, true),
      n_points: view.getUint32(at + 8, true),
    };
  });
  const floats = (nth: number) =>
    new Float32Array(buffer, header_bytes + 12 * n_orders + 4 * n_points * nth, n_points);
  return {
    kind: "profile",
    ...frameHeader(view),
    along: view.getUint8(46) === 0 ? "x" : "y",
    n_left_out: view.getUint32(48, true),
    n_lines: view.getUint32(52, true),
    width_px: view.getUint16(56, true),
    height_px: view.getUint16(58, true),
    units_per_px: view.getUint16(60, true),
    orders,
    x_mm: floats(0),
    y_mm: floats(1),
    z_mm: floats(2),
    sigma_mm: floats(3),
    pixels: new Uint16Array(buffer, header_bytes + 12 * n_orders + 16 * n_points, 2 * n_points),
  };
}

function decodePoints(buffer: ArrayBuffer, start: number): PointsBlock {
  const view = new DataView(buffer, start);
  const header_bytes = view.getUint16(2, true);
  const n_points = view.getUint32(36, true);
  const triple = (at: number): [number, number, number] => [
    view.getFloat32(at, true),
    view.getFloat32(at + 4, true),
    view.getFloat32(at + 8, true),
  ];
  return {
    kind: "points",
    block: view.getUint32(4, true),
    scan_id: uuid(new Uint8Array(buffer, start + 8, 16)),
    position_mm: view.getFloat64(24, true),
    frame: view.getUint32(32, true),
    n_points,
    origin_mm: triple(40),
    step_mm: triple(52),
    points: new Uint8Array(buffer, start + header_bytes, BYTES_PER_POINT * n_points),
    size_bytes: header_bytes + BYTES_PER_POINT * n_points,
  };
}

function uuid(bytes: Uint8Array): string {
  const hex = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  return [hex.slice(0, 8), hex.slice(8, 12), hex.slice(12, 16), hex.slice(16, 20), hex.slice(20)].join("-");
}
