/** The book-keeping of points on the graphics card: where they are, which lanes are drawn, whose block they were. */

import { describe, expect, test } from "vitest";
import { CHUNK_POINTS, Cloud, LANES } from "../../src/scene/cloud/cloud";
import { countShown, proposedRange, sampleValues } from "../../src/scene/cloud/histogram";
import { RegionGrid } from "../../src/scene/cloud/region";
import { deviation } from "../../src/scene/cloud/shapes";
import { block, type Spec } from "./blocks";

/** Display positions are rounded twice: to the steps of the stream and to those of a chunk, some µm each. */
const ROUNDED_MM = 0.006;

const line = (at_mm: number, n_points = 1000): Spec["points"] =>
  Array.from({ length: n_points }, (_, idx) => ({
    xyz_mm: [-100 + (200 * idx) / (n_points - 1), at_mm, 400],
    order: (idx % 5) - 2,
    intensity: idx % 200,
    sigma_class: 100,
    along_px: idx,
  }));

describe("a cloud", () => {
  test("keeps every point within some micrometres, with order, σ, intensity and its block", () => {
    const cloud = new Cloud();
    const specs: Spec[] = [
      { block: 0, frame: 0, position_mm: -20, points: line(-40, 700) },
      { block: 1, frame: 2, position_mm: -19.8, points: line(-39.8, 1300) },
    ];
    for (const spec of specs) cloud.append(block(spec));
    expect([cloud.n_points, cloud.n_blocks, cloud.chunks.length]).toEqual([2000, 2, 1]);
    const [chunk] = cloud.chunks;
    const wanted = specs.flatMap((spec) => spec.points.map((point) => ({ ...point, spec })));
    wanted.forEach(({ xyz_mm, spec, ...point }, idx) => {
      const at = chunk?.position(idx) ?? [0, 0, 0];
      for (const axis of [0, 1, 2] as const) expect(Math.abs(at[axis] - xyz_mm[axis])).toBeLessThan(ROUNDED_MM);
      expect(chunk?.attributes(idx)).toEqual(point);
      expect(chunk?.partOf(idx)).toMatchObject({
        block: spec.block,
        frame: spec.frame,
        position_mm: spec.position_mm,
      });
    });
  });

  test("draws every point once, thinned or not", () => {
    const cloud = new Cloud();
    cloud.append(block({ block: 0, frame: 0, position_mm: 0, points: line(0, 1003) }));
    const [chunk] = cloud.chunks;
    const count = (thinning: number) => chunk?.drawn(thinning).reduce((sum, range) => sum + range.count, 0);
    expect([1, 2, 4, 8].map(count)).toEqual([1003, 503, 252, 126]);
    const slots = chunk
      ?.drawn(1)
      .flatMap(({ start, count }) => Array.from({ length: count }, (_, idx) => start + idx));
    expect(new Set(slots).size).toBe(1003);
  });

  test("writes what was added and nothing else", () => {
    const cloud = new Cloud();
    cloud.append(block({ block: 0, frame: 0, position_mm: 0, points: line(0, 101) }));
    cloud.append(block({ block: 1, frame: 1, position_mm: 1, points: line(1, 77) }));
    const [chunk] = cloud.chunks;
    if (!chunk) throw new Error("nothing was added");
    const [from, to] = [101, chunk.n_points];
    expect(to).toBe(178);
    const ranges = chunk.written(from, to);
    expect(ranges.length).toBeLessThanOrEqual(LANES);
    expect(ranges.reduce((sum, range) => sum + range.count, 0)).toBe(77);
    const before = chunk.written(0, from).flatMap(({ start, count }) => [start, start + count]);
    for (const { start } of ranges) expect(before).toContain(start);
  });

  test("goes on in another chunk when one is full, and a full one is drawn in one piece", () => {
    const cloud = new Cloud();
    const many = line(0, 60_000);
    for (let number = 0; number < 3; number++) {
      cloud.append(block({ block: number, frame: number, position_mm: 0, points: many }));
    }
    expect(cloud.chunks.map((chunk) => chunk.n_points)).toEqual([CHUNK_POINTS, 180_000 - CHUNK_POINTS]);
    expect(cloud.chunks[0]?.drawn(1)).toEqual([{ start: 0, count: CHUNK_POINTS }]);
    expect(cloud.chunks[0]?.drawn(8)).toEqual([{ start: 0, count: CHUNK_POINTS / 8 }]);
    expect(cloud.chunks[1]?.partOf(0)).toMatchObject({ block: 2, first: 0 });
  });

  test("keeps points that lie far from the first ones", () => {
    const cloud = new Cloud();
    cloud.append(block({ block: 0, frame: 0, position_mm: 0, points: line(0, 10) }));
    cloud.append(block({ block: 1, frame: 1, position_mm: 0, points: line(500, 10) }));
    expect(cloud.chunks).toHaveLength(2);
    expect(cloud.chunks[1]?.position(0)[1]).toBeCloseTo(500, 2);
    expect(cloud.box?.max[1]).toBeCloseTo(500, 2);
  });
});

test("what is hidden is not counted: values outside, and in deviations all that is not of the feature", () => {
  const cloud = new Cloud();
  cloud.append(block({ block: 0, frame: 0, position_mm: 0, points: line(0, 1000) }));
  const shown = (low: number, high: number) => countShown(cloud, "height", undefined, { low, high });
  expect([shown(0, 1000), shown(0, 1)]).toEqual([1000, 0]);
  const plane = { kind: "plane", point_mm: [0, 0, 399.9], normal: [0, 0, 1] } as const;
  const none = new RegionGrid({ origin_mm: [0, 0, 0], cell_mm: 1, size: [1, 1, 1], cells: [], band_mm: 9 });
  const all = { low: -1e6, high: 1e6 };
  expect(countShown(cloud, "deviation", { shape: plane }, all)).toBe(1000);
  expect(countShown(cloud, "deviation", { shape: plane, grid: none }, all)).toBe(0);
});

test("a histogram is made from the values of the mode, deviations from the shape", () => {
  const cloud = new Cloud();
  cloud.append(block({ block: 0, frame: 0, position_mm: 0, points: line(0, 1000) }));
  const plane = { kind: "plane", point_mm: [0, 0, 399.9], normal: [0, 0, 1] } as const;
  const deviations = sampleValues(cloud, "deviation", { shape: plane });
  expect(deviations).toHaveLength(1000);
  expect(deviations[0]).toBeCloseTo(100, 0);
  // Of the feature are only the points in its cells, and near its shape.
  const region = { origin_mm: [-50, -50, 399], cell_mm: 100, size: [1, 1, 1], cells: [0] };
  const values = (band_mm: number, cells = [0]) =>
    sampleValues(cloud, "deviation", { shape: plane, grid: new RegionGrid({ ...region, cells, band_mm }) });
  expect(values(0.2)).toHaveLength(500);
  expect(values(0.05)).toHaveLength(0);
  expect(values(0.2, [])).toHaveLength(0);
  expect(sampleValues(cloud, "sigma", undefined)[0]).toBeCloseTo(0.1 * 2 ** (100 / 16), 3);
  expect(sampleValues(cloud, "deviation", undefined)).toHaveLength(0);
  expect(proposedRange(sampleValues(cloud, "intensity", undefined), "intensity")).toEqual({ low: 2, high: 197 });
});

test("deviations are signed distances", () => {
  expect(deviation({ kind: "sphere", centre_mm: [0, 0, 10], radius_mm: 5 }, [0, 0, 4])).toBe(1);
  expect(deviation({ kind: "plane", point_mm: [0, 0, 1], normal: [0, 0, -1] }, [9, 9, 3])).toBe(-2);
  const pipe = { kind: "cylinder", point_mm: [0, 0, 0], axis: [1, 0, 0], radius_mm: 2 } as const;
  expect(deviation(pipe, [7, 3, 4])).toBe(3);
});
