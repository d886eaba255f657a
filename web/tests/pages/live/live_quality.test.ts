/** What Live says about a frame, held by frames whose values are known. */

import { expect, test } from "vitest";
import { FrameRate } from "../../../src/pages/live/image/frame_rate";
import { adviceOf } from "../../../src/pages/live/quality/advice";
import { qualityOf, SEGMENT_POINTS, scatter } from "../../../src/pages/live/quality/quality";
import { acrossOrders, nearestLinePoint, neighbour, profilePointAt } from "../../../src/scene/plot/nearest";
import { SteadyRange } from "../../../src/scene/plot/steady_range";
import type { ImageMessage, ProfileMessage } from "../../../src/stream/protocol";

const UNITS = 32;

/** A frame of 100 × 80 px whose orders lie on straight rows. */
function image(rows: { order: number; v_px: number; from: number; to: number }[]): ImageMessage {
  const points: number[] = [];
  const lines = rows.map(({ order, v_px, from, to }) => {
    const first = points.length / 2;
    for (let u_px = from; u_px < to; u_px++) points.push(u_px * UNITS, v_px * UNITS);
    return { order, saturated: false, first, n_points: to - from };
  });
  return {
    kind: "image",
    number: 1,
    sequence: 1,
    captured_ms: 0,
    position_mm: 0,
    laser_on: true,
    calibrated: true,
    width_px: 100,
    height_px: 80,
    jpeg_width_px: 100,
    jpeg_height_px: 80,
    scale: 1,
    bit_depth: 8,
    exposure_us: 1000,
    n_saturated: 0,
    histogram: new Uint32Array(64),
    lines,
    points: Uint16Array.from(points),
    units_per_px: UNITS,
    jpeg: new Uint8Array(0),
  };
}

/** A profile of one order with the given heights; `columns` says where each was seen. */
function profile(z_mm: number[], columns = z_mm.map((_, idx) => idx)): ProfileMessage {
  return {
    kind: "profile",
    number: 1,
    sequence: 1,
    captured_ms: 0,
    position_mm: 0,
    laser_on: true,
    calibrated: true,
    along: "x",
    n_left_out: 0,
    n_lines: 1,
    width_px: 100,
    height_px: 80,
    units_per_px: UNITS,
    orders: [{ order: 0, first: 0, n_points: z_mm.length }],
    x_mm: Float32Array.from(columns, (column) => 0.1 * column),
    y_mm: new Float32Array(z_mm.length),
    z_mm: Float32Array.from(z_mm),
    sigma_mm: Float32Array.from(z_mm, (_, idx) => 0.001 * (1 + (idx % 3))),
    pixels: Uint16Array.from(columns.flatMap((column) => [column * UNITS, 40 * UNITS])),
  };
}

const WHOLE = (of: ProfileMessage) => ({ order: 0, first: 0, n_points: of.z_mm.length });

test("a slanted plane has no scatter, a zigzag has the one that statistics give", () => {
  const slanted = profile(Array.from({ length: 3 * SEGMENT_POINTS }, (_, idx) => 400 + 0.02 * idx));
  // 32-bit heights near 400 mm are rounded to 0.03 µm.
  expect(scatter(slanted, WHOLE(slanted))).toBeLessThan(2e-5);
  const zigzag = profile(Array.from({ length: 2 * SEGMENT_POINTS }, (_, idx) => (idx % 2 === 0 ? 0.01 : -0.01)));
  // Deviations of ±10 µm about their mean, two of 21 degrees of freedom taken by the line.
  const mean = 0.01 / SEGMENT_POINTS;
  const expected = Math.sqrt((SEGMENT_POINTS * (0.01 ** 2 - mean ** 2)) / (SEGMENT_POINTS - 2));
  expect(scatter(zigzag, WHOLE(zigzag))).toBeCloseTo(expected, 6);
});

test("a step at a gap is not scatter, and segments too short for a line have none", () => {
  const columns = Array.from({ length: 2 * SEGMENT_POINTS }, (_, idx) => (idx < SEGMENT_POINTS ? idx : idx + 9));
  const step = profile(
    columns.map((column) => (column < SEGMENT_POINTS ? 400 : 380)),
    columns,
  );
  expect(scatter(step, WHOLE(step))).toBeCloseTo(0, 6);
  const short = profile([1, 2, 3]);
  expect(scatter(short, WHOLE(short))).toBeUndefined();
});

test("quality counts points, columns, brightness and saturation by order; what has no order stands last", () => {
  const seen = image([
    { order: -128, v_px: 70, from: 0, to: 10 },
    { order: 0, v_px: 40, from: 0, to: 60 },
    { order: 0, v_px: 44, from: 50, to: 70 },
    { order: -1, v_px: 20, from: 0, to: 100 },
  ]);
  const data = new Uint8Array(4 * 100 * 80);
  for (let column = 0; column < 100; column++) {
    data[4 * (20 * 100 + column)] = column < 25 ? 255 : 180;
    data[4 * (40 * 100 + column)] = 90;
    data[4 * (44 * 100 + column)] = 90;
  }
  const rows = qualityOf(seen, profile(Array.from({ length: 60 }, () => 400)), { data, width: 100, height: 80 });
  expect(rows.map(({ order }) => order)).toEqual([-1, 0, -128]);
  expect(rows[0]).toMatchObject({ n_points: 100, coverage: 1, grey: 180, saturated: 0.25, sigma_mm: undefined });
  expect(rows[1]).toMatchObject({ n_points: 80, coverage: 0.7, grey: 90, saturated: 0 });
  expect(rows[1]?.sigma_mm).toBeCloseTo(0.002, 9);
  expect(rows[2]).toMatchObject({ n_points: 10, coverage: 0.1 });
});

test("advice distinguishes too bright, too dark and right", () => {
  const frame = (bright_bin: number, n_bright: number) => {
    const histogram = new Uint32Array(64);
    histogram[0] = 1_000_000 - n_bright;
    histogram[bright_bin] = n_bright;
    return histogram;
  };
  expect(adviceOf(frame(63, 45_000), 44_000)).toMatchObject({ kind: "over", saturated: 0.044 });
  expect(adviceOf(frame(12, 45_000), 0)).toMatchObject({ kind: "under", bright: 12.5 / 64 });
  expect(adviceOf(frame(50, 45_000), 0)).toMatchObject({ kind: "good", bright: 50.5 / 64 });
  // A few hot pixels neither flatten lines nor make a dark image bright.
  expect(adviceOf(frame(63, 100), 100)?.kind).toBe("under");
  expect(adviceOf(new Uint32Array(64), 0)).toBeUndefined();
});

test("the pointer means the nearest shown line within reach, and its point in the profile", () => {
  const seen = image([
    { order: 0, v_px: 40, from: 0, to: 60 },
    { order: 1, v_px: 46, from: 0, to: 60 },
  ]);
  const shown = new Set<number>();
  expect(nearestLinePoint(seen, { u_px: 12.3, v_px: 41 }, 4, shown)).toEqual({ order: 0, u_px: 12, v_px: 40 });
  expect(nearestLinePoint(seen, { u_px: 12.3, v_px: 41 }, 8, new Set([0]))?.order).toBe(1);
  expect(nearestLinePoint(seen, { u_px: 12.3, v_px: 60 }, 4, shown)).toBeUndefined();
  const measured = profile([400, 401, 402], [11, 12, 13]);
  expect(profilePointAt(measured, { order: 0, u_px: 12, v_px: 40 })).toBe(1);
  expect(profilePointAt(measured, { order: 0, u_px: 14, v_px: 40 })).toBeUndefined();
  expect(profilePointAt(measured, { order: 1, u_px: 12, v_px: 40 })).toBeUndefined();
});

test("keys walk along an order and to the next one", () => {
  const two = profile([400, 401, 402, 380, 381]);
  two.orders = [
    { order: 0, first: 0, n_points: 3 },
    { order: 1, first: 3, n_points: 2 },
  ];
  two.x_mm.set([0, 1, 2, 0.4, 1.9]);
  expect([neighbour(two, 1, 1), neighbour(two, 2, 1), neighbour(two, 3, -20)]).toEqual([2, 2, 3]);
  expect(acrossOrders(two, 2, 1, new Set())).toBe(4);
  expect(acrossOrders(two, 2, 1, new Set([1]))).toBe(2);
  expect(acrossOrders(two, 3, -1, new Set())).toBe(0);
});

test("the plot's range stands still while data tremble, and follows when they leave it or shrink", () => {
  const range = new SteadyRange(0.5);
  expect(range.follow(10, 20)).toBe(true);
  expect(range.follow(10.1, 19.8)).toBe(false);
  expect(range.follow(9, 20)).toBe(true);
  expect(range.value?.[0]).toBeLessThan(9);
  expect(range.follow(14, 16)).toBe(true);
  expect(range.follow(Infinity, -Infinity)).toBe(false);
  range.follow(5, 5);
  expect((range.value?.[1] ?? 0) - (range.value?.[0] ?? 0)).toBeGreaterThanOrEqual(0.5);
});

test("the frame rate is that of the last two seconds, and falls when frames stay out", () => {
  const rate = new FrameRate();
  expect(rate.rate_hz(0)).toBe(0);
  for (let at = 0; at <= 10_000; at += 40) rate.count(at);
  expect(rate.rate_hz(10_020)).toBeCloseTo(25, 0);
  expect(rate.rate_hz(15_000)).toBeCloseTo(0.2, 9);
});
