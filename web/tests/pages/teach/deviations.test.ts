/** Deviations from a CAD model: decoding, the map of their means, their range of colours, and the plan that asks for them. */

import { describe, expect, test } from "vitest";
import type { Schemas } from "../../../src/api/client";
import {
  EMPTY_PLAN,
  isDeviation,
  limitsIn,
  withLimits,
  withoutCharacteristic,
  withParts,
} from "../../../src/pages/teach/draft";
import {
  boundsOf,
  hasVolume,
  NO_POSE,
  proposedPose,
  surfaceProfile,
  withCoordinate,
  withEntry,
} from "../../../src/pages/teach/surface/profile";
import { halfRange_um, onScan } from "../../../src/pages/viewer/surface_deviations";
import { DeviationMap, decodeDeviations } from "../../../src/scene/cloud/deviation_map";

/** 32-bit floats of some mm and of some hundredths of a millimetre. */
const ROUNDED_MM = 1e-5;

type Row = [x: number, y: number, z: number, deviation_mm: number];

/** A response of the server: five little-endian 32-bit floats per point. */
function response(rows: readonly Row[]): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(20 * rows.length));
  rows.forEach((row, idx) => {
    [...row, 0.01].forEach((value, at) => void view.setFloat32(20 * idx + 4 * at, value, true));
  });
  return view.buffer;
}

const mapOf = (rows: readonly Row[]) => new DeviationMap(decodeDeviations(response(rows)));

/** A plate of points every 0.2 mm whose deviation grows along x. */
const PLATE = Array.from({ length: 51 * 26 }, (_, idx): Row => {
  const [x, y] = [0.2 * (idx % 51), 0.2 * Math.floor(idx / 51)];
  return [x, y, 400, 0.01 * x];
});

describe("the deviations of a scan", () => {
  test("are five little-endian floats per point, or refused", () => {
    const rows = decodeDeviations(response([[1, 2, 3, -0.5]]));
    expect([...rows.slice(0, 4)]).toEqual([1, 2, 3, -0.5]);
    expect(() => decodeDeviations(new ArrayBuffer(30))).toThrow("30 bytes");
  });

  test("are found at the points of the scan, as the mean of a cell", () => {
    const map = mapOf(PLATE);
    expect(map.cell_mm).toBeCloseTo(0.4);
    for (const [x, y, z, deviation_mm] of PLATE) {
      expect(Math.abs(map.deviation([x, y, z]) - deviation_mm)).toBeLessThan(0.01 * map.cell_mm + ROUNDED_MM);
    }
  });

  test("are unknown outside the compared surface, and at points that belong to something else", () => {
    const map = mapOf([...PLATE, [5, 2, 403, Number.NaN], [5, 2, 404, 0.1]]);
    expect(map.deviation([-5, 2, 400])).toBeNaN();
    expect(map.deviation([5, 2, 450])).toBeNaN();
    expect(map.deviation([5, 2, 403])).toBeNaN();
    expect(map.deviation([5, 2, 404])).toBeCloseTo(0.1);
    // Nothing was compared.
    expect(mapOf([[0, 0, 400, Number.NaN]]).deviation([0, 0, 400])).toBeNaN();
    expect(mapOf([]).deviation([0, 0, 0])).toBeNaN();
  });

  test("have no gaps where the displayed points are denser than the compared ones", () => {
    const thinned = PLATE.filter((_, idx) => idx % 51 < 20 || idx % 51 > 22);
    expect(mapOf(thinned).deviation([4.3, 2, 400])).toBeCloseTo(0.043, 2);
  });

  test("of a large scan fit on the graphics card", () => {
    const corners: Row[] = [
      [0, 0, 0, 0.02],
      [2000, 1500, 900, -0.02],
    ];
    const { size, values } = mapOf(corners);
    expect(Math.max(...size)).toBeLessThanOrEqual(256);
    expect(values.length).toBeLessThanOrEqual(4_000_000);
    expect(mapOf(corners).deviation([2000, 1500, 900])).toBeCloseTo(-0.02);
  });
});

describe("a comparison", () => {
  const datum_from_part = {
    rotation: [
      [-1, 0, 0],
      [0, 1, 0],
      [0, 0, -1],
    ],
    translation_mm: [1, 2, 400],
  };
  const percentiles = { p2_5_mm: -0.08, p50_mm: 0, p97_5_mm: 0.05 };
  const comparison = { percentiles, tolerance_mm: null, datum_from_part } as unknown as Schemas["ComparisonDto"];

  test("is coloured within its tolerance, or within nearly all deviations", () => {
    expect(halfRange_um({ ...comparison, tolerance_mm: 0.2 })).toBeCloseTo(200);
    expect(halfRange_um(comparison)).toBeCloseTo(80);
  });

  test("has the places of the model on the scan", () => {
    // p_model = R·p + t.
    const at = onScan(comparison, [-4, 7, 10]);
    [5, 5, 390].forEach((value, axis) => void expect(at[axis]).toBeCloseTo(value));
  });
});

describe("a surface profile", () => {
  const model = { name: "part.stl", sha256: "ab".repeat(32) };
  const entries = {
    model,
    best_fit: false,
    start: NO_POSE,
    region: undefined,
    reach_mm: undefined,
    width_mm: undefined,
  };

  test("is aligned by the datums, or by best fit from its start pose", () => {
    expect(surfaceProfile("shell", entries, true).measure).toEqual({ type: "surface_profile", model });
    expect(surfaceProfile("shell", { ...entries, best_fit: true }, true).measure).toEqual({
      type: "surface_profile",
      model,
      best_fit: true,
    });
    const start = withEntry(withEntry(NO_POSE, 2, 400), 4, 180);
    expect(surfaceProfile("shell", { ...entries, start, reach_mm: 0.5, width_mm: 0.2 }, false)).toEqual({
      id: "shell",
      measure: { type: "surface_profile", model, best_fit: true, start: [0, 0, 400, 0, 180, 0], reach_mm: 0.5 },
      upper: 0.2,
    });
  });

  test("is restricted to a box of the model", () => {
    const bounds = boundsOf({ min_mm: [-0.98, -2, -3], max_mm: [1, 2, 2.91] });
    const region = withCoordinate(bounds, "min", 2, 2.5);
    expect(surfaceProfile("shell", { ...entries, region }, true).measure).toEqual({
      type: "surface_profile",
      model,
      region: { type: "box", min_mm: [-1, -2, 2.5], max_mm: [1, 2, 3] },
    });
    expect([hasVolume(region), hasVolume(withCoordinate(bounds, "max", 0, -1))]).toEqual([true, false]);
  });

  test("needs no features, has an upper limit only, and is removed alone", () => {
    const characteristic = surfaceProfile("shell", { ...entries, width_mm: 0.2 }, false);
    const plan = withParts(EMPTY_PLAN, { features: [], characteristic });
    expect([isDeviation(characteristic), limitsIn(characteristic).upper]).toEqual([true, 0.2]);
    expect(withLimits(plan, "shell", { upper: 0.3 }).characteristics[0]).toMatchObject({ upper: 0.3 });
    expect(withoutCharacteristic(plan, "shell")).toEqual(EMPTY_PLAN);
  });

  test("is proposed in the middle of the region, its top at the nearest point", () => {
    const box: { min: [number, number, number]; max: [number, number, number] } = {
      min: [-10, -5, 390],
      max: [20, 15, 400],
    };
    // p_scan = R·p + t with half a turn about y: the top of the model, z = 9, comes to z = 390.
    expect(proposedPose({ min_mm: [0, 0, 0], max_mm: [20, 10, 9] }, box)).toEqual([15, 0, 399, 0, 180, 0]);
  });
});
