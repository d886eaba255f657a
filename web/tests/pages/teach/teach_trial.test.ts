/** Teaching on a scan: what is shown is what the server says about the plan as it is. */

import { expect, test, vi } from "vitest";
import type { Schemas } from "../../../src/api/client";
import type { Evaluation, Plan } from "../../../src/pages/teach/draft";
import { server, taught } from "./taught";

/** The server's answer to a plan: every characteristic has this value and verdict. */
function said(
  plan: Plan,
  value: number,
  verdict: "ok" | "not_ok" | null,
  part: Partial<Evaluation> = {},
): Evaluation {
  const results = plan.characteristics.map(({ id }) => ({ id, value, verdict, unit: "mm" }));
  const features = plan.features.map(({ id, shape }) => ({ id, kind: shape.type, n_points: 10 }));
  return { verdict: verdict ?? "invalid", results, features, frame: "part", ...part } as unknown as Evaluation;
}

test("a measured characteristic has the server's value, and its verdict as soon as it has limits", async () => {
  const { api, calls, last } = server();
  const { state, end } = taught(api);
  expect(calls).toEqual([]);
  state.choose("flatness");
  state.id.value = "flat";
  void state.measure.start();
  const first = await last(1);
  expect([first.path, first.body.plan.features.map(({ id }) => id)]).toEqual(["evaluate", ["flat_plane"]]);
  first.answer(said(first.body.plan, 0.02, null));
  await vi.waitFor(() => expect(state.candidate_result.value?.value).toBe(0.02));
  expect(state.candidate_result.value?.verdict).toBeNull();

  state.limits.value = { upper: 0.01 };
  expect(state.is_current.value).toBe(false);
  const second = await last(2);
  expect(second.body.plan.characteristics[0]).toMatchObject({ id: "flat", upper: 0.01 });
  second.answer(said(second.body.plan, 0.02, "not_ok"));
  await vi.waitFor(() => expect(state.is_current.value).toBe(true));
  expect(state.candidate_result.value?.verdict).toBe("not_ok");

  // Added under the same name, it is evaluated as part of the recipe.
  state.add();
  const third = await last(3);
  expect(third.body.plan).toEqual(second.body.plan);
  third.answer(said(third.body.plan, 0.02, "not_ok"));
  await vi.waitFor(() => expect(state.results.value.get("flat")?.verdict).toBe("not_ok"));
  expect(state.candidate_result.value).toBeUndefined();
  end();
});

test("a tool finds the features first, and nothing is stored", async () => {
  const { api, calls, last } = server();
  const { state, end } = taught(api);
  state.choose("sphere_diameter");
  state.result.view.region.value = { min: [-5, -5, 380], max: [5, 5, 410] };
  void state.measure.start();
  const find = await last(1);
  expect([find.path, find.body]).toEqual([
    "find-features",
    { tool: "sphere", region_mm: [-5, -5, 380, 5, 5, 410] },
  ]);
  find.answer({ features: [{ shape: { kind: "sphere", centre_mm: [0, 0, 400], radius_mm: 18.9034 } }] });
  const trial = await last(2);
  expect(trial.body.plan.features).toMatchObject([{ id: "new_sphere", shape: { radius_mm: 18.9 } }]);
  trial.answer(said(trial.body.plan, 37.8, null));
  await vi.waitFor(() => expect(state.candidate_result.value?.value).toBe(37.8));
  state.id.value = "ball";
  state.add();
  expect((await last(3)).body.plan.features.map(({ id }) => id)).toEqual(["ball_sphere"]);
  expect(calls.map(({ path }) => path)).toEqual(["find-features", "evaluate", "evaluate"]);
  end();
});

test("only the newest plan counts: an earlier request is cancelled, and its answer ignored", async () => {
  const { api, last } = server();
  const { state, end } = taught(api);
  state.choose("flatness");
  void state.measure.start();
  const first = await last(1);
  state.limits.value = { upper: 0.01 };
  const second = await last(2);
  expect([first.signal?.aborted, second.signal?.aborted]).toEqual([true, false]);
  first.answer(said(first.body.plan, 1, "ok"));
  second.answer(said(second.body.plan, 2, "not_ok"));
  await vi.waitFor(() => expect(state.candidate_result.value?.value).toBe(2));
  expect(state.trial.problem.value).toBeUndefined();
  state.limits.value = { upper: 0.03 };
  const third = await last(3);
  end();
  expect(third.signal?.aborted).toBe(true);
});

test("a refused plan says why, has no verdict, and can be corrected", async () => {
  const { api, last } = server();
  const { state, end } = taught(api);
  state.choose("circle_diameter");
  void state.measure.start();
  const first = await last(1);
  first.answer(said(first.body.plan, 5, null));
  await vi.waitFor(() => expect(state.is_current.value).toBe(true));
  state.limits.value = { lower: -0.1 };
  (await last(2)).refuse('characteristic "new": limits need a nominal');
  await vi.waitFor(() => expect(state.trial.problem.value?.detail).toContain("limits need a nominal"));
  // The value is that of the earlier plan, and marked so.
  expect([state.candidate_result.value?.value, state.is_current.value]).toEqual([5, false]);
  state.limits.value = { lower: -0.1, nominal: 5 };
  const third = await last(3);
  expect(state.trial.problem.value).toBeUndefined();
  third.answer(said(third.body.plan, 5, "ok"));
  await vi.waitFor(() => expect(state.candidate_result.value?.verdict).toBe("ok"));
  end();
});

test("in a recipe that aligns the part, regions are in the datum frame of this scan", async () => {
  const { api, last } = server();
  const { state, end } = taught(api);
  const plan = {
    format: "sheaf-plan/1",
    seed: 1,
    features: [{ id: "a", shape: { type: "plane" } }],
    alignment: { primary: "a", secondary: "b", tertiary: "c" },
    characteristics: [],
  } as unknown as Plan;
  state.plan.value = plan;
  const first = await last(1);
  expect(state.pose_blocked.value).toBe("Evaluating…");
  const pose = {
    rotation: [
      [0, -1, 0],
      [1, 0, 0],
      [0, 0, 1],
    ],
    translation_mm: [10, 0, -3],
  };
  first.answer(said(plan, 0, null, { frame: "datum", datum_from_part: pose }));
  await vi.waitFor(() => expect(state.pose_blocked.value).toBeUndefined());
  state.choose("flatness");
  state.result.view.region.value = { min: [1, 2, 3], max: [4, 6, 8] };
  void state.measure.start();
  const box = { type: "box", min_mm: [4, 1, 0], max_mm: [8, 4, 5] };
  expect((await last(2)).body.plan.features[1]).toMatchObject({ shape: { select: { region: box } } });
  end();
});

test("a reason that is typed while a version is being published is that of the next one", async () => {
  const { api, last } = server();
  const { state, end } = taught(api);
  const { recipe } = state;
  recipe.base.value = { id: "ball", version: 1, recipe: {} } as unknown as Schemas["NewestRecipeDto"];
  recipe.reason.value = "first article";
  const published = recipe.publish.start();
  const version = await last(1);
  expect(version.body).toMatchObject({ reason: "first article" });
  version.answer({ id: "ball", version: 2 });
  const newest = await last(2);
  expect(recipe.reason.value).toBe("");
  recipe.reason.value = "wider fit";
  newest.answer({ id: "ball", version: 2, recipe: {} });
  expect(await published).toBe(true);
  expect([recipe.reason.value, recipe.published.value?.version, recipe.base.value?.version]).toEqual([
    "wider fit",
    2,
    2,
  ]);
  end();
});
