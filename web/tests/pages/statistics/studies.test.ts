/** What is typed for a study, and the plan that it gives. */

import { expect, test } from "vitest";
import {
  draftOf,
  EMPTY_ARTEFACT,
  EMPTY_DRAFT,
  gaugeRrQuery,
  namesIn,
  planOf,
  wrongWith,
} from "../../../src/pages/statistics/studies/plan";
import { parseRoute, railEntryOf } from "../../../src/state/browser/route";
import { en } from "../../../src/text/en";

const words = en.studies;

test("studies belong to the health of the station", () => {
  expect(railEntryOf(parseRoute("#/studies/019a").page)).toBe("health");
});

test("limits and uncertainties are typed in µm and sent in mm, and what is empty is not sent", () => {
  const sphere = {
    artefact: " ball 7 ",
    values: { diameter: 30.0021, uncertainty: 0.6, form: 0.3 },
    limits: { probing_form: 80 },
  };
  const draft = { ...EMPTY_DRAFT, name: "after service", artefacts: { sphere } };
  expect(wrongWith(draft, words)).toBeUndefined();
  const sent = planOf(draft).acceptance?.sphere;
  expect(sent).toEqual({
    artefact: "ball 7",
    diameter_mm: 30.0021,
    uncertainty_mm: expect.closeTo(0.0006),
    form_mm: expect.closeTo(0.0003),
    expansion_per_k: 11.5e-6,
    mpe_form_mm: 0.08,
  });
});

test("what is missing is said, one thing after the other", () => {
  const draft = { ...EMPTY_DRAFT };
  expect(wrongWith(draft, words)).toBe(words.name_missing);
  const named = { ...draft, name: "n" };
  expect(wrongWith(named, words)).toBe(words.artefact_missing);
  const sphere = { ...EMPTY_ARTEFACT, artefact: "ball" };
  expect(wrongWith({ ...named, artefacts: { sphere } }, words)).toBe(words.values_missing);
  const known = { ...sphere, values: { diameter: 30, uncertainty: 0, form: 0 } };
  expect(wrongWith({ ...named, artefacts: { sphere: known } }, words)).toBe(words.limits_missing);
  const type_1 = { ...named, kind: "type_1" as const, recipe: "block", serial: "REF" };
  expect(wrongWith(type_1, words)).toBe(words.reference_missing);
  expect(wrongWith({ ...type_1, reference: 0 }, words)).toBeUndefined();
  const gauge_rr = { ...named, kind: "gauge_rr" as const, recipe: "block", parts: "A, " };
  expect(wrongWith(gauge_rr, words)).toBe(words.parts_missing);
  expect(planOf({ ...gauge_rr, parts: "A,B , C", operators: "" }).gauge_rr).toEqual({
    recipe: "block",
    characteristic: "",
    parts: ["A", "B", "C"],
    operators: [],
    n_trials: 3,
  });
});

test("the statistics of a characteristic lead to a study of it", () => {
  const draft = draftOf(new URLSearchParams(gaugeRrQuery("block", "height")));
  expect(draft).toEqual({ ...EMPTY_DRAFT, kind: "gauge_rr", recipe: "block", characteristic: "height" });
  expect(draftOf(new URLSearchParams("kind=other"))).toEqual(EMPTY_DRAFT);
});

test("names are separated by commas", () => {
  expect(namesIn(" Anna,Ben ,, ")).toEqual(["Anna", "Ben"]);
});
