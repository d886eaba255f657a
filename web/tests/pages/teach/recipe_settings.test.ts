/** The settings of a recipe: where they start from, what is published of them, and what is refused. */

import { describe, expect, test } from "vitest";
import type { Schemas } from "../../../src/api/client";
import { type Recipe, RecipeSettings } from "../../../src/pages/teach/settings/recipe_settings";
import {
  draftOf,
  draftOfRun,
  modeOf,
  type ScanDraft,
  scanFault,
  settingsOf,
  withExposures,
  withStage,
} from "../../../src/pages/teach/settings/scan_draft";
import { RUN, server, taught } from "./taught";

type ScanSettings = Schemas["ScanSettingsDto"];
type Degrees = "from_deg" | "to_deg" | "step_deg" | "speed_deg_s";

const PLAN: Schemas["Plan"] = { format: "sheaf-plan/1", seed: 1, features: [], characteristics: [] };

/** Every setting of a linear stage: a new one in the API has to be added here, and must not get lost. */
const ALL_OF_A_SCAN: Required<Omit<ScanSettings, Degrees | "exposures_us">> = {
  from_mm: -20,
  to_mm: 20,
  step_mm: 0.2,
  speed_mm_s: 5,
  mode: "continuous",
  exposure_us: 800,
  laser_power: 0.29,
  background: { every_rows: 10, above_levels: 2.5 },
  keep_frames: true,
  record: true,
};

const FULL: Required<Recipe> = {
  name: "Bracket",
  number: 12,
  serial_pattern: "BR-[0-9]{4}",
  scan: ALL_OF_A_SCAN,
  plan: PLAN,
  outputs: ["mes", "plc"],
  attributes: { drawing: "4711", customer: "" },
};

const run = (part: object = {}) => ({ ...RUN, ...part }) as unknown as Schemas["ScanRunDto"];

function settings(recipe?: Recipe): RecipeSettings {
  const made = new RecipeSettings(run());
  if (recipe) made.start(recipe);
  return made;
}

describe("settings", () => {
  test("of a recipe are published as they are if nothing is changed", () => {
    const { plan: _, ...content } = FULL;
    expect(settings(FULL).content("bracket")).toEqual(content);
    expect(settings(FULL).fault.value).toBeUndefined();
  });

  test("that are empty are absent, and the name is the id", () => {
    const all = settings(FULL);
    all.name.value = " ";
    all.number.value = undefined;
    all.serial_pattern.value = " ";
    all.outputs.value = undefined;
    for (const { row } of all.attributes.value) all.removeAttribute(row);
    all.addAttribute();
    expect(all.content("bracket")).toEqual({ name: "bracket", scan: ALL_OF_A_SCAN });
    expect(all.fault.value).toBeUndefined();
  });

  test("of a new recipe are those of the scan, also after another recipe was chosen", () => {
    const fresh = { name: "ball", scan: { from_mm: -12, to_mm: 12, step_mm: 0.4, mode: "stop_and_go" } };
    expect(settings().content("ball")).toEqual(fresh);
    const again = settings(FULL);
    again.start(undefined);
    expect(again.content("ball")).toEqual(fresh);
  });

  test("name the doors one by one, down to none", () => {
    const narrowed = settings(FULL);
    narrowed.setOutput("folder", true);
    narrowed.setOutput("mes", false);
    expect(narrowed.outputs.value).toEqual(["plc", "folder"]);
    narrowed.setOutput("plc", false);
    narrowed.setOutput("folder", false);
    // None is something else than every door.
    expect(narrowed.content("bracket").outputs).toEqual([]);
  });

  test("refuse attributes without a name, and names that are used twice", () => {
    const some = settings();
    some.addAttribute();
    some.addAttribute();
    const [first, second] = some.attributes.value.map(({ row }) => row);
    if (first === undefined || second === undefined) throw new Error("no rows");
    some.changeAttribute(first, { value: "4711" });
    expect(some.fault.value).toBe("attribute_unnamed");
    some.changeAttribute(first, { name: "drawing" });
    expect(some.fault.value).toBeUndefined();
    some.changeAttribute(second, { name: "drawing" });
    expect(some.fault.value).toBe("attribute_twice");
    some.removeAttribute(first);
    expect([some.fault.value, some.content("ball").attributes]).toEqual([undefined, { drawing: "" }]);
    // Rows keep their numbers, so that a new one is another.
    some.addAttribute();
    expect(new Set(some.attributes.value.map(({ row }) => row)).size).toBe(2);
  });

  test("refuse a pattern that no regular expression has; the server judges its own syntax", () => {
    const patterned = (pattern: string) => {
      const made = settings();
      made.serial_pattern.value = pattern;
      return made.fault.value;
    };
    for (const broken of ["[0-9", "BR-(", "a)", "*", "[9-0]", "\\"])
      expect(patterned(broken)).toBe("broken_pattern");
    for (const good of [
      "",
      "BR-[0-9]{4}",
      "X.*|Y+",
      "[[:alpha:]]+",
      "(?i)br.*",
      "(?P<n>x)",
      "a**",
      "\\d{3}\\p{L}",
    ])
      expect(patterned(good)).toBeUndefined();
  });
});

describe("the scan of a recipe", () => {
  const draft = (part: Partial<ScanDraft> = {}): ScanDraft => ({ ...draftOfRun(run()), ...part });

  test("is as the scan was on which it is taught", () => {
    const made = (part: object) => settingsOf(draftOfRun(run(part)));
    const hdr = { exposure_us: 8000, exposures_us: [500, 8000], laser_power: 0.5, keep_frames: true };
    expect(made(hdr)).toEqual({
      from_mm: -12,
      to_mm: 12,
      step_mm: 0.4,
      mode: "stop_and_go",
      exposures_us: [500, 8000],
      laser_power: 0.5,
    });
    // The row spacing of a continuous scan follows from its speed.
    const continuous = { mode: "continuous", speed_mm_s: 20, exposure_us: 900 };
    expect(made(continuous)).toEqual({
      from_mm: -12,
      to_mm: 12,
      mode: "continuous",
      speed_mm_s: 20,
      exposure_us: 900,
    });
  });

  test("of a turntable is in degrees", () => {
    const turn = { from_deg: 0, to_deg: 375, speed_deg_s: 15 };
    expect([draftOf(turn).stage, modeOf(draftOf(turn)), settingsOf(draftOf(turn))]).toEqual([
      "rotary",
      "continuous",
      turn,
    ]);
    expect(scanFault(withStage(draftOf(turn), "linear"))).toBe("no_range");
  });

  test("has no speed if it stops for every row", () => {
    const stopped: ScanDraft = { ...draftOf(ALL_OF_A_SCAN), mode: "stop_and_go" };
    expect(settingsOf(stopped)).not.toHaveProperty("speed_mm_s");
    expect(settingsOf(stopped)).toMatchObject({ step_mm: 0.2 });
  });

  test("has as many exposures as are chosen, up to the longest", () => {
    const single = draft({ exposures_us: [3600] });
    expect(withExposures(single, 3).exposures_us).toEqual([100, 600, 3600]);
    expect(withExposures(withExposures(single, 3), 1).exposures_us).toEqual([3600]);
    expect(withExposures(draft(), 2).exposures_us).toEqual([667, 4000]);
  });

  test.each<[Partial<ScanDraft>, ReturnType<typeof scanFault>]>([
    [{}, undefined],
    [{ to: undefined }, "no_range"],
    [{ step: undefined }, "no_step"],
    [{ mode: "continuous" }, undefined],
    [{ mode: "continuous", step: undefined }, "no_pace"],
    [{ mode: "continuous", to: -12 }, "no_travel"],
    [{ exposures_us: [500, 4000] }, undefined],
    [{ exposures_us: [500, undefined] }, "exposure_missing"],
    [{ exposures_us: [500, 4000], mode: "continuous" }, "exposures_continuous"],
    [{ exposures_us: [500, 4000], background: {} }, "exposures_ambient"],
    [{ exposures_us: [500, 4000], record: true }, "exposures_images"],
    [{ exposures_us: [4000, 3000] }, "exposures_similar"],
  ])("%o: %s", (part, fault) => {
    expect(scanFault(draft(part))).toBe(fault);
  });
});

test("changed settings are those of the next version, whose plan is the one that is taught", async () => {
  const { api, last } = server();
  const { state, end } = taught(api);
  const { recipe } = state;
  const { settings } = recipe;
  const loaded = recipe.load.start("bracket");
  (await last(1)).answer({ id: "bracket", version: 1, recipe: FULL });
  expect(await loaded).toBe(true);
  settings.number.value = 13;
  settings.changeScan({ from: -15 });
  recipe.reason.value = "number of the new PLC";
  void recipe.publish.start();
  const version = await last(2);
  expect(version.path).toBe("versions");
  expect(version.body).toEqual({
    reason: "number of the new PLC",
    recipe: { ...FULL, number: 13, scan: { ...FULL.scan, from_mm: -15 } },
  });
  end();
});
