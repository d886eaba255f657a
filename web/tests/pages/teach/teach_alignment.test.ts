/** Teaching the alignment of a part: which features move into the datum frame, and when it is refused. */

import { describe, expect, test, vi } from "vitest";
import { boundToFrame, datumsFault } from "../../../src/pages/teach/alignment/datums";
import { AlignmentDraft } from "../../../src/pages/teach/alignment/draft";
import { boxIn, inFrame, withAlignment } from "../../../src/pages/teach/alignment/frame";
import { featureFrom } from "../../../src/pages/teach/composed";
import { type Characteristic, EMPTY_PLAN, type Plan, type PlanFeature } from "../../../src/pages/teach/draft";
import type { Box } from "../../../src/scene/cloud/cloud";
import { inverse } from "../../../src/scene/cloud/fitted";
import { server, taught } from "./taught";

/** A quarter turn about z, x to y, and a shift. */
const POSE = {
  rotation: [
    [0, -1, 0],
    [1, 0, 0],
    [0, 0, 1],
  ],
  translation_mm: [10, 0, -3],
};

/** An eighth of a turn about z. */
const OBLIQUE = {
  rotation: [
    [Math.SQRT1_2, -Math.SQRT1_2, 0],
    [Math.SQRT1_2, Math.SQRT1_2, 0],
    [0, 0, 1],
  ],
  translation_mm: [0, 0, 0],
};

const REGION: Box = { min: [1, 2, 3], max: [4, 6, 8] };
/** The region in the datum frame: x of it is 10 − y, y is x, z is z − 3. */
const MOVED = { type: "box", min_mm: [4, 1, 0], max_mm: [8, 4, 5] };

/** Datums, one of them the rim of a plane that is none itself; and a feature that is called like the type of a datum. */
const FEATURES = [
  featureFrom("plane", "table", undefined, ""),
  featureFrom("plane", "lid", REGION, ""),
  featureFrom("edge", "front", REGION, "lid"),
  featureFrom("sphere", "ball", REGION, ""),
  featureFrom("circle", "plane", REGION, "lid"),
];
const ALIGNMENT = { primary: "table", secondary: "front", tertiary: "ball" };

function plan(...characteristics: Characteristic[]): Plan {
  return { ...EMPTY_PLAN, features: FEATURES, characteristics };
}

function regionOf(feature: PlanFeature | undefined) {
  return feature && "select" in feature.shape ? feature.shape.select?.region : undefined;
}

test("a box becomes the box around it", () => {
  expect(boxIn(REGION, POSE)).toEqual({ min: [4, 1, 0], max: [8, 4, 5] });
  const square = boxIn({ min: [-1, -1, 0], max: [1, 1, 1] }, OBLIQUE);
  expect(square.max[0]).toBeCloseTo(Math.SQRT2, 12);
});

test("balls, cylinders, directions and contours move exactly, and back", () => {
  const selected = (select: object) => ({ id: "a", shape: { type: "plane", select } }) as PlanFeature;
  const ball = selected({ region: { type: "sphere", centre_mm: [1, 2, 3], radius_mm: 5 } });
  const tube = selected({
    region: { type: "cylinder", centre_mm: [1, 2, 3], axis: [2, 0, 0], radius_mm: 5, half_length_mm: 7 },
    facing: { normal: [0, 1, 0], within_deg: 20 },
    orders: [0],
  });
  const section = {
    id: "cut",
    shape: {
      type: "section",
      select: {},
      origin_mm: [1, 2, 3],
      x: [1, 0, 0],
      y: [0, 0, 1],
      contour_mm: [
        [0, 0],
        [5, 1],
      ],
    },
  } as PlanFeature;
  expect(inFrame(ball, POSE)).toEqual(
    selected({ region: { type: "sphere", centre_mm: [8, 1, 0], radius_mm: 5 } }),
  );
  expect(inFrame(tube, POSE)).toEqual(
    selected({
      region: { type: "cylinder", centre_mm: [8, 1, 0], axis: [0, 2, 0], radius_mm: 5, half_length_mm: 7 },
      facing: { normal: [-1, 0, 0], within_deg: 20 },
      orders: [0],
    }),
  );
  expect(inFrame(section, POSE).shape).toMatchObject({
    origin_mm: [8, 1, 0],
    x: [0, 1, 0],
    y: [0, 0, 1],
    contour_mm: [
      [0, 0],
      [5, 1],
    ],
  });
  for (const one of [ball, tube, section]) expect(inFrame(inFrame(one, POSE), inverse(POSE))).toEqual(one);
  const derived: PlanFeature = { id: "middle", shape: { type: "point", of: { centre: "table" } } };
  expect(inFrame(derived, POSE)).toBe(derived);
});

test("datums and what they depend on stay; all other features move, and back", () => {
  const aligned = withAlignment(plan(), ALIGNMENT, (one) => inFrame(one, POSE));
  expect(aligned.alignment).toEqual(ALIGNMENT);
  // Table, front with its lid, ball.
  expect(aligned.features.slice(0, 4)).toEqual(FEATURES.slice(0, 4));
  expect(regionOf(aligned.features[4])).toEqual(MOVED);
  const back = withAlignment(aligned, undefined, (one) => inFrame(one, inverse(POSE)));
  expect(back).toEqual(plan());
  expect("alignment" in back).toBe(false);
});

test("three different features of the plan are datums", () => {
  const offered = ["table", "front", "ball"];
  const fault = (secondary: string, tertiary: string) =>
    datumsFault({ primary: "table", secondary, tertiary }, offered);
  expect([fault("front", "ball"), fault("front", ""), fault("front", "gone"), fault("front", "table")]).toEqual([
    undefined,
    "missing",
    "missing",
    "repeated",
  ]);
});

test("what has a place in a frame keeps the plan in it", () => {
  const shell = { id: "shell", measure: { type: "surface_profile", best_fit: true } } as Characteristic;
  const at: Characteristic = { id: "at", measure: { type: "coordinate", of: "ball", axis: "x" } };
  const high: Characteristic = { id: "high", measure: { type: "step", base: "table", top: "lid" } };
  const along: Characteristic = {
    id: "along",
    measure: { type: "distance", from: "front", to: "ball", along: "y" },
  };
  const all = plan(shell, at, high, along);
  expect(boundToFrame(all)).toEqual(["shell"]);
  expect(boundToFrame({ ...all, alignment: ALIGNMENT })).toEqual(["shell", "at", "along"]);
});

describe("on a scan", () => {
  /** A plan that is taught, with its first evaluation answered. */
  async function teaching(...characteristics: Characteristic[]) {
    const { api, last } = server();
    const { state, end } = taught(api);
    const draft = new AlignmentDraft(api as never, state);
    state.plan.value = plan(...characteristics);
    (await last(1)).answer({ results: [], features: [], frame: "part" });
    draft.chosen.value = ALIGNMENT;
    return { state, draft, last, end };
  }

  test("the plan is aligned in one step, what is taught then moves, and without the alignment all is as before", async () => {
    const { state, draft, last, end } = await teaching();
    const done = draft.align.start();
    const asked = await last(2);
    expect([asked.path, asked.body.plan.alignment]).toEqual(["evaluate", ALIGNMENT]);
    expect(state.plan.value.alignment).toBeUndefined();
    asked.answer({ results: [], features: [], frame: "datum", datum_from_part: OBLIQUE });
    expect(await done).toBe(true);
    expect(state.plan.value.alignment).toEqual(ALIGNMENT);
    expect(state.plan.value.features.slice(0, 4)).toEqual(FEATURES.slice(0, 4));
    const turned = { type: "box", min_mm: [-3.54, 2.12, 3], max_mm: [1.41, 7.07, 8] };
    expect(regionOf(state.plan.value.features[4])).toEqual(turned);

    // The datum frame is known at once, before the aligned plan is evaluated.
    expect([state.pose.value, state.pose_blocked.value]).toEqual([OBLIQUE, undefined]);
    state.result.view.region.value = REGION;
    state.addFeature((region) => featureFrom("plane", "late", region, ""));
    expect(regionOf(state.plan.value.features[5])).toEqual(turned);

    // Turned forth and back the boxes would be larger.
    draft.remove();
    expect(state.plan.value).toEqual({
      ...plan(),
      features: [...FEATURES, featureFrom("plane", "late", REGION, "")],
    });
    expect([state.pose.value, draft.chosen.value]).toEqual([undefined, ALIGNMENT]);
    end();
  });

  test("the regions of a recipe that was aligned elsewhere are turned back", async () => {
    const { state, last, end } = await teaching();
    const aligned = withAlignment(plan(), ALIGNMENT, (one) => inFrame(one, POSE));
    state.replacePlan(aligned);
    (await last(2)).answer({ results: [], features: [], frame: "datum", datum_from_part: POSE });
    await vi.waitFor(() => expect(state.pose.value).toEqual(POSE));
    state.unalign();
    expect(state.plan.value).toEqual(plan());
    end();
  });

  test("datums that leave a degree of freedom are refused by its name, and the plan stays", async () => {
    const { state, draft, last, end } = await teaching();
    const before = state.plan.value;
    const done = draft.align.start();
    const alignment_failure = "the datums do not constrain the rotation about z";
    (await last(2)).answer({ results: [], features: [], frame: "part", alignment_failure });
    expect(await done).toBe(false);
    expect(draft.align.problem.value?.detail).toBe(alignment_failure);
    expect(state.plan.value).toBe(before);
    end();
  });

  test("a frame that is found too late, for another recipe, is ignored", async () => {
    const { state, draft, last, end } = await teaching();
    const done = draft.align.start();
    const asked = await last(2);
    state.replacePlan(structuredClone(plan()));
    const other = state.plan.value;
    asked.answer({ results: [], features: [], frame: "datum", datum_from_part: POSE });
    await done;
    expect(state.plan.value).toBe(other);
    end();
  });

  test("limits that are set while the frame is being found are kept", async () => {
    const high: Characteristic = { id: "high", measure: { type: "step", base: "table", top: "lid" } };
    const { state, draft, last, end } = await teaching(high);
    const done = draft.align.start();
    const asked = await last(2);
    expect(asked.body.plan.characteristics).toEqual([]);
    state.plan.value = { ...state.plan.value, characteristics: [{ ...high, upper: 1 }] };
    asked.answer({ results: [], features: [], frame: "datum", datum_from_part: POSE });
    await done;
    expect(state.plan.value).toMatchObject({ alignment: ALIGNMENT, characteristics: [{ upper: 1 }] });
    end();
  });

  test("a frame of other datums is not that of the plan", async () => {
    const { state, draft, last, end } = await teaching();
    const done = draft.align.start();
    (await last(2)).answer({ results: [], features: [], frame: "datum", datum_from_part: POSE });
    await done;
    (await last(3)).answer({ results: [], features: [], frame: "datum", datum_from_part: POSE });
    await vi.waitFor(() => expect(state.is_current.value).toBe(true));
    state.plan.value = { ...state.plan.value, alignment: { ...ALIGNMENT, tertiary: "plane" } };
    expect([state.pose.value, state.pose_blocked.value]).toEqual([undefined, "Evaluating…"]);
    end();
  });
});
