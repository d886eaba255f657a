/** Colours, views, picks and mesh files: the mathematics of the viewer. */

import { describe, expect, test } from "vitest";
import type { Schemas } from "../../src/api/client";
import { Cloud } from "../../src/scene/cloud/cloud";
import { matchPoint } from "../../src/scene/cloud/exact_point";
import { meshFromGlb } from "../../src/scene/cloud/glb";
import { binned, proposedRange } from "../../src/scene/cloud/histogram";
import { pick, project } from "../../src/scene/cloud/picking";
import type { Vec3 } from "../../src/scene/cloud/shapes";
import { orderTable, palette, rgb } from "../../src/scene/colours";
import { Orbit } from "../../src/scene/view/orbit";
import { roundLength } from "../../src/scene/view/overlay";
import { Thinning } from "../../src/scene/view/thinning";
import { NO_ORDER_COLOUR, orderColour } from "../../src/theme";
import { block } from "./blocks";

test("near the camera is high, and high is bright", () => {
  expect(palette("height")[0]).toBe(palette("sigma").at(-1));
  expect(palette("deviation")[4]).toBe("#f2f2f2");
});

test("orders have the colours of the theme", () => {
  const table = orderTable();
  expect(table[2]).toEqual(rgb(orderColour(-2)));
  expect(table[4]).toEqual(rgb("#009E73"));
  expect(table.at(-1)).toEqual(rgb(NO_ORDER_COLOUR));
});

test("a proposed range leaves out the outermost hundredth; a histogram what is outside", () => {
  const values = Float32Array.from({ length: 1001 }, (_, idx) => idx);
  expect(proposedRange(values, "height")).toEqual({ low: 10, high: 990 });
  expect(binned(values, { low: 0, high: 500 }, 5)).toEqual([100, 100, 100, 100, 101]);
});

describe("a view", () => {
  const box = { min: [-100, -50, 360], max: [100, 50, 400] } as {
    min: [number, number, number];
    max: [number, number, number];
  };
  test.each(["front", "top", "side", "iso"] as const)("%s fits the whole box, in both projections", (name) => {
    for (const orthographic of [false, true]) {
      const orbit = new Orbit();
      orbit.orthographic = orthographic;
      orbit.resize(1.6);
      orbit.view(name);
      orbit.fit(box);
      const clip = orbit.clip();
      for (let corner = 0; corner < 8; corner++) {
        const at = ([0, 1, 2] as const).map((axis) => ((corner >> axis) & 1 ? box.max[axis] : box.min[axis]));
        const [x, y, depth] = project(clip, at as [number, number, number], 1600, 1000);
        expect(x).toBeGreaterThan(0);
        expect(x).toBeLessThan(1600);
        expect(y).toBeGreaterThan(0);
        expect(y).toBeLessThan(1000);
        expect(Math.abs(depth)).toBeLessThan(1);
      }
    }
  });

  test("from the top is as the camera sees it: x to the right, y down", () => {
    const orbit = new Orbit();
    orbit.resize(1);
    orbit.view("top");
    orbit.fit(box);
    const clip = orbit.clip();
    const [centre, right, down] = [
      [0, 0, 380],
      [10, 0, 380],
      [0, 10, 380],
    ].map((at) => project(clip, at as [number, number, number], 100, 100));
    expect((right?.[0] ?? 0) - (centre?.[0] ?? 0)).toBeGreaterThan(1);
    expect((down?.[1] ?? 0) - (centre?.[1] ?? 0)).toBeGreaterThan(1);
  });

  test("with z up the part stands on its other side, and is not mirrored", () => {
    const orbit = new Orbit();
    const cross = ([a, b, c]: Vec3, [d, e, f]: Vec3): Vec3 => [b * f - c * e, c * d - a * f, a * e - b * d];
    for (const z_up of [false, true]) {
      orbit.z_up = z_up;
      const { right, up, back } = orbit.basis();
      expect(Math.sign(up[2])).toBe(z_up ? 1 : -1);
      for (const axis of [0, 1, 2] as const) expect(cross(right, up)[axis]).toBeCloseTo(back[axis], 9);
    }
  });

  test("zooming keeps the place under the pointer", () => {
    const orbit = new Orbit();
    orbit.orthographic = true;
    orbit.resize(1);
    orbit.view("top");
    orbit.fit(box);
    const [before] = [project(orbit.clip(), [40, -20, 380], 100, 100)];
    orbit.zoom(0.5, (before[0] - 50) / 50, (50 - before[1]) / 50);
    const after = project(orbit.clip(), [40, -20, 380], 100, 100);
    expect(after[0]).toBeCloseTo(before[0], 6);
    expect(after[1]).toBeCloseTo(before[1], 6);
  });

  test("a pick finds the point under the pointer, and of two the one in front", () => {
    const at = (x: number, y: number, z: number, along_px: number) => ({
      xyz_mm: [x, y, z] as [number, number, number],
      order: 1,
      intensity: 50,
      sigma_class: 80,
      along_px,
    });
    const cloud = new Cloud();
    const points = [at(0, 0, 400, 1), at(0, 0, 370, 2), at(60, 20, 380, 3), at(-90, -40, 390, 4)];
    cloud.append(block({ block: 7, frame: 9, position_mm: 1.5, points }));
    const orbit = new Orbit();
    orbit.orthographic = true;
    orbit.resize(1.6);
    orbit.view("top");
    orbit.fit(box);
    const clip = orbit.clip();
    const size = { width_px: 1600, height_px: 1000 };
    const under = (x_px: number, y_px: number) => pick(cloud, clip, { x_px, y_px, ...size });
    const [x, y] = project(clip, [60, 20, 380], 1600, 1000);
    expect(under(x + 3, y - 3)).toMatchObject({ block: 7, frame: 9, stage_mm: 1.5, order: 1, along_px: 3 });
    const [x0, y0] = project(clip, [0, 0, 370], 1600, 1000);
    expect(under(x0, y0)?.along_px).toBe(2);
    expect(under(x + 40, y)).toBeUndefined();
    // A hidden point is not there.
    const behind = pick(cloud, clip, { x_px: x0, y_px: y0, ...size }, (_, point) => point === 1);
    expect(behind?.along_px).toBe(1);
  });
});

test("the server's point is that of the same order and place on the line", () => {
  const profile: Schemas["ProfileDto"] = {
    sequence: 4,
    position_mm: 2,
    calibration_id: "c",
    order: [0, 1, 1],
    x_mm: [5, 5, 5.2],
    y_mm: [9, 9, 9],
    z_mm: [380, 380, 380.1],
    sigma_mm: [0.01, 0.02, 0.03],
    u_px: [640.2, 640.3, 641.1],
    v_px: [500, 400, 400],
  };
  const picked = {
    position_mm: [5.002, 7.001, 379.998] as const,
    block: 4,
    frame: 4,
    stage_mm: 2,
    order: 1,
    sigma_class: 120,
    intensity: 50,
    along_px: 640,
  };
  expect(matchPoint(profile, [0, 1, 0], picked)).toEqual({
    position_mm: [5, 7, 380],
    sigma_mm: 0.02,
    order: 1,
    u_px: 640.3,
    v_px: 400,
    frame: 4,
    stage_mm: 2,
  });
  expect(matchPoint(profile, [0, 1, 0], { ...picked, order: 2 })).toBeUndefined();
  expect(matchPoint(profile, [0, 1, 0], { ...picked, position_mm: [6, 7, 380] })).toBeUndefined();
});

test("a point seen on a turntable is turned back about its axis", () => {
  const of_point = { order: [0], x_mm: [5], y_mm: [9], z_mm: [380], sigma_mm: [0.01], u_px: [640], v_px: [500] };
  const profile = { sequence: 3, angle_deg: 90, captured_at_ns: null, calibration_id: "c", ...of_point };
  const axis = { point_mm: [0, 0, 400] as const, direction: [0, -1, 0] as const };
  const picked = { block: 1, frame: 3, stage_mm: 90, order: 0, sigma_class: 1, intensity: 1, along_px: 640 };
  const found = matchPoint(profile, axis, { ...picked, position_mm: [-20, 9, 395] });
  expect(found?.stage_mm).toBe(90);
  expect(found?.position_mm.map((mm) => Math.round(mm * 1e6) / 1e6)).toEqual([-20, 9, 395]);
});

test("a mesh is read from GLB without a copy, and what is none is refused", () => {
  const description = {
    accessors: [
      { bufferView: 0, componentType: 5126, count: 3, type: "VEC3" },
      { bufferView: 1, componentType: 5125, count: 3, type: "SCALAR" },
    ],
    bufferViews: [{ buffer: 0 }, { buffer: 0, byteOffset: 36 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
  };
  let text = JSON.stringify(description);
  text += " ".repeat((4 - (text.length % 4)) % 4);
  const file = new ArrayBuffer(12 + 8 + text.length + 8 + 48);
  const view = new DataView(file);
  const head = [0x46546c67, 2, file.byteLength, text.length, 0x4e4f534a];
  for (const [idx, word] of head.entries()) view.setUint32(4 * idx, word, true);
  new Uint8Array(file).set(new TextEncoder().encode(text), 20);
  const binary = 20 + text.length + 8;
  const positions = [0, 0, 0.4, 0.1, 0, 0.4, 0, 0.1, 0.4];
  for (const [idx, value] of positions.entries()) view.setFloat32(binary + 4 * idx, value, true);
  for (const corner of [0, 1, 2]) view.setUint32(binary + 36 + 4 * corner, corner, true);
  const mesh = meshFromGlb(file);
  expect(mesh.positions_m.buffer).toBe(file);
  expect([...mesh.indices]).toEqual([0, 1, 2]);
  expect(mesh.positions_m[3]).toBeCloseTo(0.1);
  expect(() => meshFromGlb(new ArrayBuffer(100))).toThrow("no GLB");
});

test("a scale bar has a round length", () => {
  expect([0.7, 3.4, 12, 99, 100].map(roundLength)).toEqual([0.5, 2, 10, 50, 100]);
});

test("a moving cloud is thinned when frames come late, and drawn in full at rest", () => {
  const pace = new Thinning(8);
  pace.begin(6_000_000);
  expect(pace.factor).toBe(4);
  pace.frame(50);
  pace.frame(50);
  expect(pace.factor).toBe(8);
  for (let frame = 0; frame < 20; frame++) pace.frame(16);
  expect(pace.factor).toBe(4);
  pace.rest();
  expect(pace.factor).toBe(1);
});
