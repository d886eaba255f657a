/** Teaching: from what was measured to the plan of a recipe. */

import { describe, expect, test } from "vitest";
import { ProblemError, type Schemas } from "../../../src/api/client";
import { candidates, characteristicFrom, featureFrom, rolesOf } from "../../../src/pages/teach/composed";
import {
  boxOf,
  EMPTY_PLAN,
  idFault,
  limited,
  limitsIn,
  partsOf,
  withLimits,
  withoutCharacteristic,
  withParts,
} from "../../../src/pages/teach/draft";
import { recipeFile } from "../../../src/pages/teach/recipe/recipe_file";

const REGION = { min: [-5, -5, 380] as [number, number, number], max: [5, 5, 410] as [number, number, number] };

/** A fitted plane whose points fill 4 mm × 2 mm at a depth. */
function plane(z: number, x = 0): Schemas["FeatureDto"] {
  const region = { origin_mm: [x, 0, z], cell_mm: 1, size: [4, 2, 1], cells: [0, 3, 7], band_mm: 0.1 };
  const shape = { kind: "plane" as const, point_mm: [0, 0, z], normal: [0, 0, -1] };
  return { role: "plane", shape, n_points: 100, n_outliers: 0, n_border: 0, rms_mm: 0.01, region };
}

test("a step becomes two planes, each searched around its points and within the region", () => {
  const { features, characteristic } = partsOf("step", "height", REGION, [plane(400), plane(391, 3)]);
  expect(features.map(({ id }) => id)).toEqual(["height_base", "height_top"]);
  const region = (idx: number) => {
    const shape = features[idx]?.shape;
    return shape && "select" in shape ? shape.select.region : undefined;
  };
  // One millimetre around the cells, but not beyond the region.
  expect(region(0)).toEqual({ type: "box", min_mm: [-1, -1, 399], max_mm: [5, 3, 402] });
  expect(region(1)).toEqual({ type: "box", min_mm: [2, -1, 390], max_mm: [5, 3, 393] });
  expect(characteristic).toEqual({
    id: "height",
    measure: { type: "step", base: "height_base", top: "height_top" },
  });
});

test("a sphere keeps its region and the approximate radius", () => {
  const shape = { kind: "sphere" as const, centre_mm: [0, 0, 400], radius_mm: 18.9034 };
  const { features, characteristic } = partsOf("sphere_diameter", "ball", undefined, [{ ...plane(400), shape }]);
  expect(features).toEqual([{ id: "ball_sphere", shape: { type: "sphere", select: {}, radius_mm: 18.9 } }]);
  expect(characteristic.measure).toEqual({ type: "diameter", of: "ball_sphere" });
});

test("a hole brings the plane around it", () => {
  const { features, characteristic } = partsOf("circle_diameter", "hole", REGION, []);
  expect(features.map(({ id, shape }) => [id, shape.type])).toEqual([
    ["hole_plane", "plane"],
    ["hole_circle", "circle"],
  ]);
  expect(features[1]?.shape).toMatchObject({ plane: "hole_plane" });
  expect(characteristic.measure).toEqual({ type: "diameter", of: "hole_circle" });
});

describe("a plan", () => {
  const step = partsOf("step", "height", REGION, [plane(400), plane(391)]);
  const flat = partsOf("flatness", "flat", REGION, []);
  const plan = withParts(withParts(EMPTY_PLAN, step), flat);

  test("loses a characteristic with the features that only it used", () => {
    const without = withoutCharacteristic(plan, "height");
    expect(without.features.map(({ id }) => id)).toEqual(["flat_plane"]);
    const shared = { id: "lies", measure: { type: "parallelism" as const, of: "height_top", to: "flat_plane" } };
    const both = { ...plan, characteristics: [...plan.characteristics, shared] };
    expect(withoutCharacteristic(both, "height").features.map(({ id }) => id)).toEqual([
      "height_top",
      "flat_plane",
    ]);
    const alignment = { primary: "height_base", secondary: "height_top", tertiary: "flat_plane" };
    expect(withoutCharacteristic({ ...plan, alignment }, "height").features).toHaveLength(3);
  });

  test("loses the plane of a rim together with the rim", () => {
    const hole = withParts(plan, partsOf("circle_diameter", "hole", REGION, []));
    expect(withoutCharacteristic(hole, "hole").features).toEqual(plan.features);
  });

  test("has each name once", () => {
    expect([idFault(plan, ""), idFault(plan, "height"), idFault(plan, "width")]).toEqual([
      "empty",
      "used",
      undefined,
    ]);
    // Its features would have the names of others.
    const other = { ...plan, characteristics: [], features: plan.features };
    expect(idFault(other, "height")).toBe("used");
  });

  test("has limits in the unit of the value, and loses them when they are emptied", () => {
    const limits = { nominal: 8.9, lower: -0.03, upper: 0.02 };
    const with_limits = withLimits(plan, "height", limits);
    expect(with_limits.characteristics[0]).toMatchObject({ nominal_mm: 8.9, lower: -0.03, upper: 0.02 });
    const emptied = withLimits(with_limits, "height", { lower: undefined }).characteristics[0];
    expect(emptied && "lower" in emptied).toBe(false);
    expect(emptied && limitsIn(emptied)).toEqual({ nominal: 8.9, lower: undefined, upper: 0.02 });
    const angle = partsOf("angle", "tilt", REGION, [plane(400), plane(391)]).characteristic;
    expect(limited(angle, { nominal: 30 })).toMatchObject({ nominal_deg: 30 });
  });
});

test("the box of a feature without a region is unknown", () => {
  const { region: _, ...bare } = plane(400);
  expect(boxOf(bare)).toBeUndefined();
});

describe("a characteristic from several features", () => {
  const features = [
    featureFrom("plane", "table", undefined, ""),
    featureFrom("plane", "top", REGION, ""),
    featureFrom("edge", "left", REGION, "table"),
    featureFrom("cylinder", "right", REGION, ""),
    featureFrom("circle", "hole", REGION, "top"),
  ];
  const plan = { ...EMPTY_PLAN, features };

  test("asks for features of the kinds that the server accepts", () => {
    const offered = (composed: Parameters<typeof rolesOf>[0]) =>
      rolesOf(composed).map((role) => candidates(plan, role));
    expect(offered("gap")).toEqual([
      ["left", "right"],
      ["left", "right"],
      ["table", "top"],
    ]);
    expect(offered("coordinate_z")).toEqual([["hole"]]);
    expect(offered("parallelism")).toEqual([
      ["table", "top"],
      ["table", "top"],
    ]);
    expect(offered("distance")[0]).toHaveLength(5);
  });

  test("exists once all are chosen, and different", () => {
    const made = (chosen: Record<string, string>) => characteristicFrom("gap", "seam", chosen);
    expect(made({ from: "left", to: "right" })).toBeUndefined();
    expect(made({ from: "left", to: "left", surface: "table" })).toBeUndefined();
    expect(made({ from: "left", to: "right", surface: "table" })).toEqual({
      id: "seam",
      measure: { type: "gap", from: "left", to: "right", surface: "table" },
    });
    const groove = { floor: "a", shoulder_1: "b", shoulder_2: "c" };
    expect(characteristicFrom("groove_depth", "groove", groove)?.measure).toMatchObject({ shoulders: ["b", "c"] });
  });

  test("names the plane of a rim, and its region", () => {
    expect(features[2]?.shape).toMatchObject({ type: "edge", plane: "table" });
    expect(features[1]?.shape).toMatchObject({ select: { region: { type: "box", min_mm: [-5, -5, 380] } } });
  });
});

test("a file is read as a recipe by its format and id; any other is refused with a remedy", () => {
  const file = { format: "sheaf-recipe/1", id: "bracket", version: 3, recipe: {} };
  expect(recipeFile(JSON.stringify(file))).toEqual(file);
  for (const content of ["", "no JSON", "null", "[1]", '{"id": "bracket"}', '{"format": "sheaf-recipe/1"}']) {
    expect(() => recipeFile(content)).toThrow(ProblemError);
  }
});
