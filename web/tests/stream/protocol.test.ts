/** The bytes of the live stream, held by the samples that the server's tests write and read. */

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "vitest";
import { decode, decodeBlocks, sigmaOfClass } from "../../src/stream/protocol";
import type { ServerText } from "../../src/stream/text_messages";

const GOLDEN = join(import.meta.dirname, "../../../tests/golden/ws");

function golden(name: string): ArrayBuffer {
  const bytes = readFileSync(join(GOLDEN, name));
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength) as ArrayBuffer;
}

test("a message of an opcode that is not known is let pass", () => {
  expect(decode(new Uint8Array([99, 0, 0, 0]).buffer)).toBeUndefined();
});

test("the texts of the server are known by their op", () => {
  const texts = JSON.parse(readFileSync(join(GOLDEN, "server_texts.json"), "utf8")) as ServerText[];
  const known = ["hello", "subscribed", "pong", "error", "state", "job", "event", "scan", "dropped"];
  expect(texts.map((text) => text.op)).toEqual(known);
});

test("the image's sample reads by the table", () => {
  const image = decode(golden("image.bin"));
  if (image?.kind !== "image") throw new Error("no image");
  const { number, sequence, captured_ms, position_mm, laser_on, calibrated } = image;
  expect([number, sequence, captured_ms, position_mm]).toEqual([17, 4711, 12345.678901, -7.25]);
  expect([laser_on, calibrated]).toEqual([true, true]);
  expect([image.width_px, image.height_px, image.jpeg_width_px, image.jpeg_height_px]).toEqual([64, 48, 16, 12]);
  expect([image.scale, image.bit_depth, image.exposure_us, image.n_saturated]).toEqual([4, 8, 2000, 2]);
  expect([image.histogram[0], image.histogram[35], image.histogram[63]]).toEqual([3000, 70, 2]);
  expect(image.lines).toEqual([
    { order: -1, saturated: false, first: 0, n_points: 3 },
    { order: -128, saturated: false, first: 3, n_points: 2 },
    { order: 1, saturated: true, first: 5, n_points: 2 },
  ]);
  const pixels = Array.from(image.points, (units) => units / image.units_per_px);
  expect(pixels).toEqual([2, 5.25, 3, 5.5, 4, 5.75, 9, 8, 10, 8.125, 3, 30, 4, 30.5]);
});

test("the profile's sample reads by the table", () => {
  const profile = decode(golden("profile.bin"));
  if (profile?.kind !== "profile") throw new Error("no profile");
  expect([profile.number, profile.along, profile.n_left_out, profile.n_lines]).toEqual([18, "x", 2, 4]);
  expect(profile.orders).toEqual([
    { order: -1, first: 0, n_points: 2 },
    { order: 0, first: 2, n_points: 1 },
    { order: 1, first: 3, n_points: 2 },
  ]);
  expect([...profile.x_mm]).toEqual([-20.5, -20.25, 0.125, 20, 20.25]);
  expect([...profile.y_mm]).toEqual([-12, -12, 0.5, 12.5, 12.5]);
  expect([...profile.z_mm]).toEqual([401.25, 401.5, 399, 400, 400.5]);
  expect([...profile.sigma_mm].map((sigma) => Number(sigma.toFixed(6)))).toEqual([
    0.004, 0.004, 0.003, 0.005, 0.005,
  ]);
  expect([...profile.pixels].slice(0, 4).map((units) => units / profile.units_per_px)).toEqual([2, 5.25, 3, 5.5]);
});

test("the points' sample reads by the table, alone and behind another", () => {
  const bytes = new Uint8Array(golden("points.bin"));
  const two = new Uint8Array(2 * bytes.length);
  two.set(bytes);
  two.set(bytes, bytes.length);
  const blocks = decodeBlocks(two.buffer);
  expect(blocks).toHaveLength(2);
  for (const block of blocks) {
    expect([block.block, block.frame, block.n_points, block.position_mm]).toEqual([5, 6, 3, -7.25]);
    expect(block.scan_id).toBe("01890a5d-ac96-774b-bcce-b302099a8057");
    const view = new DataView(block.points.buffer, block.points.byteOffset, block.points.byteLength);
    const coordinate = (point: number, axis: 0 | 1 | 2) =>
      block.origin_mm[axis] + view.getUint16(12 * point + 2 * axis, true) * block.step_mm[axis];
    expect([0, 1, 2].map((point) => coordinate(point, 0))).toEqual([
      -1,
      expect.closeTo(1, 4),
      expect.closeTo(0, 4),
    ]);
    expect(coordinate(1, 2)).toBeCloseTo(401, 4);
    expect([0, 1, 2].map((point) => view.getInt8(12 * point + 8))).toEqual([-1, 0, 1]);
    expect(sigmaOfClass(view.getUint8(9))).toBeCloseTo(0.004, 4);
    expect(sigmaOfClass(view.getUint8(33))).toBeNaN();
  }
});
