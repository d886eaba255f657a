/** A curved part compared with its CAD model: taught as a surface profile, inspected, deviations as colours. */

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Schemas } from "../../src/api/client";
import { englishIn } from "../support/german";
import { calibrated, expectAccessibleInBoth, launch, picture, until, visit, wholeCloud } from "../support/harness";
import { pixelsOf } from "../support/pixels";
import type { Server } from "../support/server";
import { curvedSurface, nominalHeight, placePart, realHeight, stlOf } from "../support/stl";

/** Tests that calibrate or scan, on a busy machine. */
const STATION_MS = 300_000;

/** Height of the bump and depth of the dent, mm. */
const DEFECT_MM = 0.25;

/** Width of the tolerance zone, mm; to either side half of it is permitted. */
const WIDTH_MM = 3;

/** The range of colours in which bump and dent reach the ends, µm. */
const RANGE_UM = 60;

/** What the model leaves out along the rim, where lines end and points are less certain, mm. */
const MARGIN_MM = 2;

/** Both ends of the scale, and points that were not compared, `#rrggbb`. */
const [INSIDE, OUTSIDE, UNKNOWN] = ["#2166ac", "#b2182b", "#9aa0a6"];

const MODEL = {
  name: "curved.stl",
  mimeType: "model/stl",
  buffer: Buffer.from(stlOf(curvedSurface(nominalHeight, MARGIN_MM))),
};

let server: Server;
let browser: Browser;
let scan_id: string;

beforeAll(async () => {
  [server, browser] = await Promise.all([calibrated(), launch()]);
  await placePart(server, stlOf(curvedSurface(realHeight(DEFECT_MM), 0)));
  scan_id = await server.scan();
}, 600_000);

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

/** The length at the end of a cell, mm. */
function lengthIn(cell: string | undefined): number {
  const [, number, unit] = /([\d.]+) (mm|µm)$/.exec(cell ?? "") ?? [];
  if (number === undefined) throw new Error(`no length in "${cell}"`);
  return Number(number) / (unit === "µm" ? 1000 : 1);
}

/** Pixels of the cloud that are inside, outside, and not compared. */
async function coloured(page: Page): Promise<number[]> {
  // The page in which pixels are counted may have come to the front, and a hidden page draws no frames.
  await page.bringToFront();
  return await pixelsOf(page.locator(".cloud-canvas canvas"), [INSIDE, OUTSIDE, UNKNOWN], { shaded: true });
}

/** The legend spans ± the permitted deviation; in a smaller range bump and dent have the colours of its ends. */
async function expectDeviations(page: Page): Promise<void> {
  const legend = page.locator(".cloud-legend");
  const ticks = () => legend.locator(".ticks span").allTextContents();
  await legend.getByText("Deviation (curved.stl), µm").waitFor();
  await legend.getByText("Red: outside the surface; blue: inside; grey: not compared.").waitFor();
  expect(await ticks()).toEqual(["−1,500", "−750", "0", "750", "1,500"]);
  await legend.getByLabel("From", { exact: true }).fill(`${-RANGE_UM}`);
  await legend.getByLabel("To", { exact: true }).fill(`${RANGE_UM}`);
  await page.keyboard.press("Enter");
  await until("the smaller range", async () => (await ticks()).join() === "−60,−30,0,30,60");
  await until("both ends of the scale, and what was not compared", async () => {
    const counts = await coloured(page);
    return counts.length === 3 && counts.every((count) => count > 20);
  });
}

test(
  "a surface profile is taught with an uploaded model, has its value at once, and colours the part",
  async () => {
    const { page, context, complaints } = await visit(browser, server.url, `#/teach/${scan_id}`);
    await wholeCloud(page);
    await page.getByText("Surface profile", { exact: true }).click();
    const card = page.locator("details.surface");
    await card.locator(".why", { hasText: "Choose a model." }).last().waitFor();

    // What is no model is refused with a remedy.
    const choose = card.locator("input[type=file]");
    await choose.setInputFiles({ name: "empty.stl", mimeType: "model/stl", buffer: Buffer.from("solid nothing") });
    await card.locator(".problem").waitFor();
    expect(await card.locator(".problem").textContent()).toMatch(/Remedy:|What to do:/);
    await card.locator(".problem button").click();

    await choose.setInputFiles(MODEL);
    await card.locator("[data-model='curved.stl']").waitFor();
    expect(await card.locator("[data-model]").textContent()).toContain("1,408 triangles, 44.0 × 16.0 ×");
    // The proposed pose: z of the model towards the camera.
    expect(await card.getByLabel("Rotation about y").inputValue()).toBe("180");
    await card.getByLabel("x", { exact: true }).fill("0");
    await card.getByLabel("Maximum distance").fill("0.6");
    await card.getByLabel("Width of the zone").fill(String(WIDTH_MM));
    await card.getByLabel("Name").fill("shell");
    // A box of the model: all of it at first.
    await card.getByLabel("Only a box of the model").check();
    const low_x = card.getByLabel("x from");
    const bound = await low_x.inputValue();
    await low_x.fill("99");
    await low_x.blur();
    await card.locator(".why", { hasText: "The box is empty" }).waitFor();
    await low_x.fill(bound);
    await low_x.blur();
    await card.locator(".why", { hasText: "The box is empty" }).waitFor({ state: "detached" });
    await expectAccessibleInBoth(page);
    await picture(page, "surface-profile-form");
    await card.getByRole("button", { name: "Add to the recipe" }).click();

    const row = page.locator("[data-taught=shell]");
    await page.locator("[data-taught=shell] [data-verdict=ok]").waitFor();
    const cells = await row.locator("td").allTextContents();
    const [value_mm, u_mm] = [lengthIn(cells[1]), lengthIn(cells[2])];
    expect(Math.abs(value_mm - 2 * DEFECT_MM)).toBeLessThan(u_mm);
    const comparison = page.locator("[data-comparison=shell]");
    await comparison.getByText("95 % range").waitFor();
    await comparison.getByRole("button", { name: "Show deviations" }).click();
    await comparison.getByRole("button", { name: "Hide deviations" }).waitFor();
    await page.getByRole("button", { name: "Top", exact: true }).click();
    await expectDeviations(page);
    await expectAccessibleInBoth(page);
    await picture(page, "surface-profile-teach");

    await page.getByLabel("ID", { exact: true }).fill("curved");
    const publish = page.getByRole("region", { name: "Publish version" });
    await publish.getByLabel("Reason").fill("first article");
    await publish.getByRole("button", { name: "Publish version" }).click();
    await page.locator('[data-published="curved@1"]').waitFor();
    expect(complaints).toEqual([]);
    await context.close();
  },
  STATION_MS,
);

test(
  "an inspection leads from the largest deviations to their places, and shows all of them as colours",
  async () => {
    const job = await server.job("/api/v1/inspections", { recipe: "curved", serial: "C-1" });
    const id = job.result?.id ?? "";
    const inspection = await server.call<Schemas["InspectionDto"]>("GET", `/api/v1/inspections/${id}`);
    const worst = inspection.results[0]?.comparison?.worst ?? [];
    expect(worst.length).toBeGreaterThan(1);
    const { page, context, complaints } = await visit(browser, server.url, `#/inspections/${id}`);
    await wholeCloud(page);
    const comparison = page.locator("[data-comparison=shell]");
    const rows = comparison.locator("[data-worst]");
    expect(await rows.count()).toBe(worst.length);

    // A row loads the deviations and highlights its place.
    await rows.nth(1).getByRole("button", { name: "Show" }).click();
    await comparison.getByRole("button", { name: "Hide deviations" }).waitFor();
    await page.locator('.label.current[data-label="shell/1"]').waitFor();
    await page.locator("[data-worst='1'][aria-current=true]").waitFor();
    // And back: the label of a place highlights its row.
    // Labels of near places may cover each other, so the event is sent to this one.
    await page.locator('[data-label="shell/0"]').dispatchEvent("click");
    await page.locator("[data-worst='0'][aria-current=true]").waitFor();
    await page.getByRole("button", { name: "Top", exact: true }).click();
    await expectDeviations(page);
    await page.locator(".cloud-view").scrollIntoViewIfNeeded();
    await picture(page, "deviations");
    await expectAccessibleInBoth(page);
    await comparison.scrollIntoViewIfNeeded();
    await picture(page, "deviations-table");

    // The mesh of the part has the same colours, also if the cloud never had them.
    await page.reload();
    await page.getByRole("button", { name: "Show mesh" }).click();
    const shown = page.locator(".cloud-tools select").nth(1);
    await until("the mesh alone", async () => (await shown.inputValue()) === "mesh");
    await comparison.getByRole("button", { name: "Show deviations" }).click();
    await comparison.getByRole("button", { name: "Hide deviations" }).waitFor();
    await page.getByRole("button", { name: "Top", exact: true }).click();
    await expectDeviations(page);
    await page.locator(".cloud-view").scrollIntoViewIfNeeded();
    await picture(page, "deviations-mesh");

    await comparison.getByRole("button", { name: "Hide deviations" }).click();
    await comparison.getByRole("button", { name: "Show deviations" }).waitFor();
    expect(await page.locator(".cloud-tools select").first().inputValue()).not.toBe("deviation");
    await page.locator("[data-characteristic=shell]").getByRole("button", { name: "Show" }).click();
    await comparison.getByRole("button", { name: "Hide deviations" }).waitFor();
    expect(complaints).toEqual([]);
    await context.close();
  },
  STATION_MS,
);

test("the comparison fits a phone, and is German for Germans", async () => {
  const { items } = await server.call<{ items: Schemas["InspectionDto"][] }>("GET", "/api/v1/inspections");
  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, locale: "de-DE" };
  const { page, context, complaints } = await visit(browser, server.url, `#/inspections/${items[0]?.id}`, phone);
  const narrow = () => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
  await page.getByRole("button", { name: "Abweichungen anzeigen" }).click();
  await page.getByRole("button", { name: "Abweichungen ausblenden" }).waitFor();
  expect([await narrow(), await englishIn(page, "main")]).toEqual([true, []]);
  await page.goto(`${server.url}/#/teach/${scan_id}`);
  await page.getByText("Flächenprofil", { exact: true }).click();
  await page.getByText("Lage vorschlagen").waitFor();
  expect([await narrow(), await englishIn(page, "main")]).toEqual([true, []]);
  await picture(page, "surface-profile-phone");
  expect(complaints).toEqual([]);
  await context.close();
});
