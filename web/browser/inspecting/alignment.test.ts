/** A part aligned by datums while it is taught: what is taught before and after, and the plan that is published. */

import type { Browser, Locator, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Schemas } from "../../src/api/client";
import { block, HEIGHT_MM } from "../support/block";
import { calibrated, expectAccessibleInBoth, launch, picture, until, visit, wholeCloud } from "../support/harness";
import type { Server } from "../support/server";
import { type Corner, placePart, stlOf, type Triangle } from "../support/stl";

/** Tests that calibrate or scan, on a busy machine. */
const STATION_MS = 300_000;

/** Radius of the dome on the middle of the block, mm. */
const DOME_MM = 4;

/** Facets around the dome, and from its rim to its top: 5 µm below the sphere at most. */
const [AROUND, UPWARD] = [64, 16];

/** z between the table and the top of the block, and between that and the dome, mm: z points away from the camera. */
const [ABOVE_TABLE_MM, ABOVE_TOP_MM] = [396, 390.4];

/** Nearer to the camera than the part, mm: 20 mm above the table. */
const FROM_MM = 380;

/** From an edge of the block to its middle, mm. */
const HALF_MM = 10;

/** An edge is found to within this, mm: the blur of the lines that end there. */
const EDGE_OFF_MM = 0.2;

/** The centre of so small a dome is found to within this, mm: 0.081 off, U 0.077; this is about the frame, not accuracy. */
const DOME_OFF_MM = 0.15;

/** The flatness in a box that was turned, and so is slightly larger, mm: more points, more extreme noise (0.035 RMS). */
const SIMILAR_MM = 0.1;

let server: Server;
let browser: Browser;
let scan_id: string;

/** The upper half of a sphere whose centre is in the middle of the top of the block. */
function dome(): readonly Triangle[] {
  const at = (around: number, up: number): Corner => {
    const [turn, rise] = [(2 * Math.PI * around) / AROUND, (Math.PI * up) / (2 * UPWARD)];
    const across = DOME_MM * Math.cos(rise);
    return [across * Math.cos(turn), across * Math.sin(turn), HEIGHT_MM + DOME_MM * Math.sin(rise)];
  };
  const cells = Array.from({ length: AROUND * UPWARD }, (_, idx) => [idx % AROUND, Math.floor(idx / AROUND)]);
  return cells.flatMap(([around = 0, up = 0]): Triangle[] => {
    const [a, b] = [at(around, up), at(around + 1, up)];
    const [c, d] = [at(around + 1, up + 1), at(around, up + 1)];
    // The last ring meets in one point.
    return up + 1 === UPWARD
      ? [[a, b, c]]
      : [
          [a, b, c],
          [a, c, d],
        ];
  });
}

beforeAll(async () => {
  [server, browser] = await Promise.all([calibrated(), launch()]);
  await placePart(server, stlOf([...block(HEIGHT_MM), ...dome()]));
  scan_id = await server.scan();
}, 600_000);

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

/** From and to, mm. */
type Range = readonly [number, number];

/** Selects regions by their numbers; symmetric ones, so that the direction of an axis does not matter. */
class Regions {
  private all = 0;

  constructor(private readonly page: Page) {}

  /** Opens the numbers of the region that contains all points. */
  async open(): Promise<void> {
    await this.selectAll();
    await this.facts.click();
    this.all = await this.nPoints();
  }

  /** Selects the points of the part within `x` and `y` that are nearer to the camera than `z_to_mm`. */
  async select(x: Range, y: Range, z_to_mm: number): Promise<void> {
    await this.selectAll();
    await until("all points", async () => (await this.nPoints()) === this.all);
    for (const [axis, [from, to]] of [["x", x] as const, ["y", y] as const]) {
      await this.field(`${axis} from`).fill(String(from));
      await this.field(`${axis} to`).fill(String(to));
    }
    await this.field("z from").fill(String(FROM_MM));
    await this.field("z to").fill(String(z_to_mm));
    await this.page.keyboard.press("Enter");
    await until("fewer points", async () => (await this.nPoints()) < this.all / 2);
  }

  private get facts(): Locator {
    return this.page.locator("[data-region-points]");
  }

  private field(label: string): Locator {
    return this.page.getByRole("region", { name: "Region", exact: true }).getByLabel(label, { exact: true });
  }

  private async selectAll(): Promise<void> {
    await this.page.getByRole("button", { name: "Select what is in view" }).click();
    await this.facts.waitFor();
  }

  private async nPoints(): Promise<number> {
    return Number(await this.facts.getAttribute("data-region-points"));
  }
}

/** Adds a feature that is searched in the region; `plane`: that of a rim. */
async function addFeature(page: Page, type: string, id: string, plane?: string): Promise<void> {
  const form = page.getByRole("group", { name: "Feature", exact: true });
  await form.locator("select").first().selectOption(type);
  if (plane !== undefined) await form.locator("select").nth(1).selectOption(plane);
  await form.getByLabel("Name").fill(id);
  await form.getByRole("button", { name: "Add the feature" }).click();
  await page.locator(`[data-feature=${id}]`, { hasText: "points" }).waitFor();
}

/** Adds a coordinate of a feature; returns its value, mm. */
async function addCoordinate(page: Page, axis: string, of: string, id: string): Promise<number> {
  const form = page.getByRole("group", { name: "Characteristic", exact: true });
  await form.locator("select").first().selectOption(`coordinate_${axis}`);
  await form.locator("select").nth(1).selectOption(of);
  await form.getByLabel("Name").fill(id);
  await form.getByRole("button", { name: "Add to the recipe" }).click();
  return await lengthOf(page, id);
}

/** The value of a characteristic of the plan as it is, mm. */
async function lengthOf(page: Page, id: string): Promise<number> {
  const value = page.locator(`[data-taught=${id}][data-current=true] td`).nth(1).filter({ hasText: " mm" });
  return Number.parseFloat((await value.textContent()) ?? "");
}

test(
  "a part is aligned by a plane, an edge and a sphere, and measured in their frame",
  async () => {
    const { page, context, complaints } = await visit(browser, server.url, `#/teach/${scan_id}`);
    await wholeCloud(page);
    const regions = new Regions(page);
    await page.getByText("Characteristics from several features").click();

    // The datums; the table is the largest plane of all points.
    await addFeature(page, "plane", "table");
    await regions.open();
    await regions.select([-9, 9], [-7, 7], ABOVE_TABLE_MM);
    await addFeature(page, "plane", "top");
    await regions.select([7, 13], [-6, 6], ABOVE_TABLE_MM);
    await addFeature(page, "edge", "side", "top");
    await regions.select([-4, 4], [-4, 4], ABOVE_TOP_MM);
    await addFeature(page, "sphere", "ball");
    // And a characteristic that none of them has to do with.
    await regions.select([5.5, 8], [-5, 5], ABOVE_TABLE_MM);
    await page.getByLabel("What is measured").selectOption("flatness");
    const tool = page.getByRole("region", { name: "Characteristic", exact: true });
    await tool.getByLabel("Name").fill("flat");
    await tool.getByRole("button", { name: "Measure" }).click();
    await page.locator("[data-trial=flatness]").waitFor();
    await tool.getByRole("button", { name: "Add to the recipe" }).click();
    const flat_mm = await lengthOf(page, "flat");

    // Coordinates have to wait for the alignment, which says what it needs.
    const composed = page.getByRole("group", { name: "Characteristic", exact: true });
    await composed.locator("select").first().selectOption("coordinate_y");
    await composed.getByText("Align the part first").waitFor();
    await page.getByText("Alignment", { exact: true }).click();
    const alignment = page.locator("details.alignment");
    const datum = (name: string) => alignment.getByLabel(`${name} datum`);
    await alignment.getByText("Choose three datums.").waitFor();
    await datum("First").selectOption("table");
    await datum("Second").selectOption("side");
    await datum("Third").selectOption("table");
    await alignment.getByText("Choose three different datums.").waitFor();
    await datum("Third").selectOption("top");
    await alignment.getByRole("button", { name: "Align" }).click();
    await alignment.locator(".problem", { hasText: "the translation along x" }).waitFor();
    expect(await alignment.locator("[data-aligned]").count()).toBe(0);
    await expectAccessibleInBoth(page);
    await datum("Third").selectOption("ball");
    await alignment.getByRole("button", { name: "Align" }).click();
    await alignment.locator("[data-aligned]").waitFor();
    expect(await alignment.locator("[data-aligned] dd").allTextContents()).toEqual(["table", "side", "ball"]);

    // What was taught before is still there; what is taught now is found, too.
    expect(Math.abs((await lengthOf(page, "flat")) - flat_mm)).toBeLessThan(SIMILAR_MM);
    await regions.select([-4, 4], [-4, 4], ABOVE_TOP_MM);
    await addFeature(page, "sphere", "dome");
    expect(Math.abs((await addCoordinate(page, "y", "ball", "width")) - HALF_MM)).toBeLessThan(EDGE_OFF_MM);
    expect(Math.abs((await addCoordinate(page, "z", "dome", "high")) - HEIGHT_MM)).toBeLessThan(DOME_OFF_MM);
    await alignment.getByText("Remove first what is measured in the datum frame: width, high.").waitFor();
    await alignment.scrollIntoViewIfNeeded();
    await expectAccessibleInBoth(page);
    await picture(page, "teach-alignment");

    await page.getByLabel("ID", { exact: true }).fill("aligned");
    const publish = page.getByRole("region", { name: "Publish version" });
    await publish.getByLabel("Reason").fill("aligned by its datums");
    await publish.getByRole("button", { name: "Publish version" }).click();
    await page.locator('[data-published="aligned@1"]').waitFor();

    // Without what needs it, the alignment can be removed; its datums stay chosen.
    for (const id of ["width", "high"]) await page.getByRole("button", { name: `Remove ${id}` }).click();
    await alignment.getByRole("button", { name: "Remove alignment" }).click();
    await alignment.locator("[data-aligned]").waitFor({ state: "detached" });
    expect(await datum("Second").inputValue()).toBe("side");
    expect(await lengthOf(page, "flat")).toBe(flat_mm);
    expect(complaints).toEqual([]);
    await context.close();
  },
  STATION_MS,
);

test("the published plan has the regions of its datums in the frame of the scan, all others in theirs", async () => {
  const version = await server.call<Schemas["RecipeVersionDto"]>("GET", "/api/v1/recipes/aligned/versions/1");
  const { plan } = version.recipe;
  expect(plan.alignment).toEqual({ primary: "table", secondary: "side", tertiary: "ball" });
  const boxOf = (id: string) => {
    const shape = plan.features.find((feature) => feature.id === id)?.shape;
    const region = shape && "select" in shape ? shape.select?.region : undefined;
    if (region?.type !== "box") throw new Error(`no box of ${id}`);
    return region;
  };
  // The camera is far above: z of the scan is several hundred millimetres, that of the datum frame a few.
  for (const id of ["top", "side", "ball"]) expect(boxOf(id).min_mm[2]).toBeGreaterThan(100);
  expect(boxOf("side").min_mm.slice(0, 2)).toEqual([7, -6]);
  for (const id of ["flat_plane", "dome"]) {
    const [z_min = 0, z_max = 0] = [boxOf(id).min_mm[2], boxOf(id).max_mm[2]];
    expect(z_min).toBeGreaterThan(0);
    expect(z_max).toBeLessThan(25);
  }
  // The dome is at x = 0, and as far from the edge as the middle of the block.
  const { min_mm, max_mm } = boxOf("dome");
  const middle = [0, 1].map((axis) => ((min_mm[axis] ?? 0) + (max_mm[axis] ?? 0)) / 2);
  expect(Math.abs(middle[0] ?? 9)).toBeLessThan(1);
  expect(Math.abs((middle[1] ?? 0) - HALF_MM)).toBeLessThan(1);
});
