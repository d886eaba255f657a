/** Regions, cuts and the difference of two scans: the geometry of the viewer's tools. */

import { describe, expect, test } from "vitest";
import { Cloud } from "../../src/scene/cloud/cloud";
import { cutProfile, distanceInCut, middleCut } from "../../src/scene/cloud/cut";
import { featureOnCloud, inverse, isInRegion, moved, placeOf, shapeInPart } from "../../src/scene/cloud/fitted";
import { HeightMap } from "../../src/scene/cloud/height_map";
import { project } from "../../src/scene/cloud/picking";
import { featureDeviation } from "../../src/scene/cloud/region";
import { regionIn } from "../../src/scene/cloud/region_pick";
import type { Vec3 } from "../../src/scene/cloud/shapes";
import { countIn, isDisplayed } from "../../src/scene/cloud/space";
import { Orbit } from "../../src/scene/view/orbit";
import { block } from "./blocks";

/** Positions are stored in steps of a few µm. */
const STEP_MM = 0.01;

/** A cloud of one point per position; orders are taken in turn. */
function cloudOf(positions: readonly Vec3[], n_orders = 1): Cloud {
  const cloud = new Cloud();
  const points = positions.map((at, idx) => ({
    xyz_mm: [...at] as [number, number, number],
    order: idx % n_orders,
    intensity: 50,
    sigma_class: 80,
    along_px: 1,
  }));
  cloud.append(block({ block: 0, frame: 0, position_mm: 0, points }));
  return cloud;
}

/** Points every 0.1 mm over 20 mm × 10 mm at the height of a function. */
function surface(z: (x: number, y: number) => number): Vec3[] {
  const found: Vec3[] = [];
  for (let x = -10; x <= 10; x += 0.1) for (let y = -5; y <= 5; y += 0.1) found.push([x, y, z(x, y)]);
  return found;
}

const PLATE = surface(() => 400);

describe("a rectangle of the view", () => {
  const cloud = cloudOf([...PLATE, [0, 0, 390], [0, 0, 380]]);
  const orbit = new Orbit();
  orbit.orthographic = true;
  orbit.resize(1);
  orbit.view("top");
  orbit.fit(cloud.box ?? { min: [0, 0, 0], max: [1, 1, 1] });
  const size = { width_px: 800, height_px: 800 };
  const corner = (at: Vec3) => project(orbit.clip(), at, 800, 800);
  const [[left_px, top_px], [right_px, bottom_px]] = [corner([-4, -2, 400]), corner([6, 3, 400])];
  const rectangle = { left_px, top_px, right_px, bottom_px };

  test("selects the points inside it, with their depth", () => {
    const region = regionIn(cloud, orbit.clip(), rectangle, size, () => true);
    const expected = { min: [-4, -2, 380], max: [6, 3, 400] };
    for (const axis of [0, 1, 2] as const) {
      expect(Math.abs((region?.min[axis] ?? 0) - (expected.min[axis] ?? 0))).toBeLessThan(0.12);
      expect(Math.abs((region?.max[axis] ?? 0) - (expected.max[axis] ?? 0))).toBeLessThan(0.12);
    }
  });

  test("leaves out hidden points, and is undefined without points", () => {
    const region = regionIn(cloud, orbit.clip(), rectangle, size, ([, , z]) => z > 395);
    expect(region?.min[2]).toBeGreaterThan(399);
    expect(regionIn(cloud, orbit.clip(), rectangle, size, () => false)).toBeUndefined();
  });
});

test("a crop box and a cut hide what is outside and beyond", () => {
  const crop = { min: [0, 0, 0] as [number, number, number], max: [10, 10, 10] as [number, number, number] };
  const cut = { axis: 0 as const, at_mm: 5, thickness_mm: 1, hides: true };
  expect(isDisplayed({ crop, cut }, [5.4, 5, 5])).toBe(true);
  expect(isDisplayed({ crop, cut }, [5.6, 5, 5])).toBe(false);
  expect(isDisplayed({ crop, cut: { ...cut, hides: false } }, [5.6, 5, 5])).toBe(true);
  expect(isDisplayed({ crop, cut: undefined }, [5, 5, 11])).toBe(false);
});

test("a cut contains the points of its slab, by order and along the axis", () => {
  const cloud = cloudOf([...PLATE, [3, 0, 390]], 2);
  const cut = { ...middleCut({ min: [-10, -5, 380], max: [10, 5, 400] }, 1), thickness_mm: 0.3 };
  expect(cut.at_mm).toBe(0);
  const shown = cutProfile(cloud, cut, { crop: undefined, cut });
  expect([shown.across, shown.up]).toEqual(["x", "z"]);
  expect(shown.profile.orders.map(({ order }) => order)).toEqual([0, 1]);
  const rows = new Set(shown.at.map(([, y]) => Math.round(10 * y)));
  expect([...rows].sort()).toEqual([-1, 0, 1]);
  for (const { first, n_points } of shown.profile.orders) {
    const along = [...shown.profile.x_mm.slice(first, first + n_points)];
    expect(along).toEqual([...along].sort((a, b) => a - b));
  }
  const crop = { min: [2, -5, 380] as [number, number, number], max: [10, 5, 395] as [number, number, number] };
  expect(cutProfile(cloud, cut, { crop, cut }).at).toHaveLength(1);
  expect(countIn(cloud, crop)).toBe(1);
});

test("a distance in a cut leaves out the direction across it", () => {
  const { distance_mm, across_mm, up_mm } = distanceInCut(1, [0, 7, 400], [3, -9, 396]);
  expect([distance_mm, across_mm, up_mm]).toEqual([5, 3, -4]);
});

describe("the distance from the surface of another scan", () => {
  const slope = 0.4;
  const map = new HeightMap(cloudOf(surface((x) => 400 + slope * x)));

  test("is measured along the normal, positive towards the camera, on slopes too", () => {
    const normal = Math.hypot(1, slope);
    const at = ([x, y]: readonly [number, number], nearer_mm: number): Vec3 => [x, y, 400 + slope * x - nearer_mm];
    expect(map.deviation(at([1.23, 0.4], 0))).toBeCloseTo(0, 2);
    expect(map.deviation(at([-7.7, 3.3], 0.06 * normal))).toBeCloseTo(0.06, 2);
    expect(map.deviation(at([4, -4], -0.5 * normal))).toBeCloseTo(-0.5, 2);
  });

  test("is unknown beside the other scan and at its edges", () => {
    expect(map.deviation([30, 0, 400])).toBeNaN();
    // An edge through the middle of a cell.
    const edge_x = map.origin_mm[0] + 20.5 * map.cell_mm;
    const step = new HeightMap(cloudOf(surface((x) => (x < edge_x ? 400 : 390))));
    expect(step.deviation([edge_x + 2, 0, 390])).toBeCloseTo(0, 2);
    expect(step.deviation([edge_x - 2, 0, 390])).toBeCloseTo(10, 1);
    expect(step.deviation([edge_x, 0, 395])).toBeNaN();
    // A low edge, which is not steep: its points are far from any plane.
    const low = new HeightMap(cloudOf(surface((x) => (x < edge_x ? 400 : 399.4))));
    expect(low.deviation([edge_x, 0, 399.7])).toBeNaN();
  });
});

describe("a feature of a plan", () => {
  const pose = {
    rotation: [
      [0, 1, 0],
      [-1, 0, 0],
      [0, 0, 1],
    ],
    translation_mm: [5, 2, -400],
  };

  test("is moved from the datum frame to the part frame and back", () => {
    const at: Vec3 = [3, 4, 390];
    expect(moved(inverse(pose), moved(pose, at)).map((mm) => Math.round(1e9 * mm) / 1e9)).toEqual(at);
    const plane = {
      id: "top",
      kind: "plane" as const,
      n_points: 9,
      n_left_out: 0,
      findings: [],
      geometry: { kind: "plane" as const, point_mm: [...moved(pose, at)], normal: [0, 0, -1] },
    };
    expect(placeOf(plane, inverse(pose))?.map((mm) => Math.round(1e9 * mm) / 1e9)).toEqual(at);
    expect(shapeInPart(plane, inverse(pose))).toMatchObject({
      kind: "plane",
      normal: [0, 0, -1].map((n) => n + 0),
    });
  });

  test("contains the points near its shape in its region, and no others", () => {
    const cloud = cloudOf([...PLATE, ...surface(() => 391).filter(([x]) => x > 4)]);
    const region = { type: "box" as const, min_mm: [-5, -5, 380], max_mm: [0, 5, 410] };
    const shape = { kind: "plane" as const, point_mm: [0, 0, 400] as const, normal: [0, 0, -1] as const };
    const feature = featureOnCloud(cloud, shape, 0.004, (at) => isInRegion(region, at));
    expect(featureDeviation(feature, [-2, 1, 399.99])).toBeCloseTo(0.01, 2);
    expect(featureDeviation(feature, [-2, 1, 399.9])).toBeNaN();
    expect(featureDeviation(feature, [6, 1, 399.99])).toBeNaN();
  });

  test("has a region of any shape", () => {
    const ball = { type: "sphere" as const, centre_mm: [1, 0, 0], radius_mm: 2 };
    expect([isInRegion(ball, [2.9, 0, 0]), isInRegion(ball, [3.1, 0, 0])]).toEqual([true, false]);
    const rod = {
      type: "cylinder" as const,
      centre_mm: [0, 0, 0],
      axis: [0, 0, 2],
      radius_mm: 1,
      half_length_mm: 3,
    };
    expect([isInRegion(rod, [0.9, 0, 2.9]), isInRegion(rod, [0, 0, 3.1]), isInRegion(rod, [0.9, 0.9, 0])]).toEqual(
      [true, false, false],
    );
  });
});

test("positions are those of the blocks", () => {
  const [first] = cloudOf(PLATE).chunks;
  const at = first?.position(17);
  expect(Math.hypot(...(at ?? []).map((mm, axis) => mm - (PLATE[17]?.[axis] ?? 0)))).toBeLessThan(STEP_MM);
});
