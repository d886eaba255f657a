/** Parts inspected by a recipe on the simulated station, as an operator and an engineer see them. */

import { readFileSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { blockRecipe, DEFECT_MM, HEIGHT_MM, placeBlock } from "../support/block";
import { englishIn } from "../support/german";
import { calibrated, expectAccessibleInBoth, launch, picture, until, visit } from "../support/harness";
import type { Server } from "../support/server";

/** Tests that calibrate or scan, on a busy machine. */
const STATION_MS = 300_000;

let server: Server;
let browser: Browser;

beforeAll(async () => {
  [server, browser] = await Promise.all([calibrated(), launch()]);
  const recipe = blockRecipe(DEFECT_MM / 2);
  await server.call("POST", "/api/v1/recipes", { id: "block", reason: "first article", recipe });
}, 600_000);

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

const serials = (page: Page) => page.locator("[data-inspection] .name").allTextContents();

test(
  "inspections are listed, filtered by the server, and shown with their limits",
  async () => {
    await placeBlock(server, HEIGHT_MM);
    await server.job("/api/v1/inspections", { recipe: "block", serial: "BL-1", order: "4711" });
    await placeBlock(server, HEIGHT_MM - DEFECT_MM);
    await server.job("/api/v1/inspections", { recipe: "block", serial: "BL-2" });

    const { page, context, complaints } = await visit(browser, server.url, "#/results");
    await page.getByRole("navigation", { name: "Results" }).getByRole("link", { name: "Inspections" }).click();
    await page.locator("[data-inspection]").nth(1).waitFor();
    expect(await serials(page)).toEqual(["BL-2", "BL-1"]);
    expect(await page.locator("[data-inspection]").first().textContent()).toContain("✕ NOT OK");
    await expectAccessibleInBoth(page);

    // The filter stands in the address; what a link says is what the server is asked.
    await page.getByLabel("Verdict").selectOption("ok");
    await page.locator("tr[data-verdict=not_ok]").waitFor({ state: "detached" });
    await until("only those that are OK", async () => (await serials(page)).join() === "BL-1");
    expect(page.url()).toMatch(/#\/inspections\?verdict=ok$/);
    await page.goto(`${server.url}/#/inspections?recipe=block%401&serial=BL-2`);
    await page.locator("tr[data-verdict=ok]").waitFor({ state: "detached" });
    await page.locator("tr[data-verdict=not_ok]").waitFor();
    await until("only that serial number", async () => (await serials(page)).join() === "BL-2");
    expect(await page.getByLabel("Serial number").inputValue()).toBe("BL-2");
    await page.getByLabel("Serial number").fill("BL-9");
    await page.keyboard.press("Enter");
    await page.getByText("No inspection matches the filter.").waitFor();
    await page.getByRole("button", { name: "Clear the filter" }).click();
    await page.getByLabel("From day").fill("2100-01-01");
    await page.getByText("No inspection matches the filter.").waitFor();
    await page.getByRole("button", { name: "Clear the filter" }).click();

    // The selection as a file: a row per characteristic of the parts that match.
    await page.getByLabel("Verdict").selectOption("not_ok");
    await until("only the part that is not OK", async () => (await serials(page)).join() === "BL-2");
    const [download] = await Promise.all([
      page.waitForEvent("download"),
      page.getByRole("link", { name: "Export as CSV" }).click(),
    ]);
    expect(download.suggestedFilename()).toBe("inspections.csv");
    const lines = readFileSync(await download.path(), "utf8").split("\r\n");
    expect(lines[0]).toMatch(/^inspection_id,seq,serial,/);
    expect(lines.slice(1).map((line) => line.split(",")[2])).toEqual(["BL-2", "BL-2", undefined]);
    await page.getByRole("button", { name: "Clear the filter" }).click();

    // One inspection: the worst first, with its limits.
    await page.getByRole("link", { name: "BL-2", exact: true }).click();
    const rows = page.locator("[data-characteristic]");
    await rows.first().waitFor();
    const ids = await rows.evaluateAll((all) => all.map((row) => row.getAttribute("data-characteristic")));
    expect(ids).toEqual(["height", "flat"]);
    const cells = await rows.first().locator("td").allTextContents();
    expect(cells.slice(1, 4)).toEqual(["8.900 mm", "8.870 mm", "8.930 mm"]);
    expect(Math.abs(Number.parseFloat(cells[4] ?? "") - (HEIGHT_MM - DEFECT_MM))).toBeLessThan(DEFECT_MM / 4);
    expect(cells[5]).toMatch(/µm$/);
    expect(cells[6]).toBe("✕ NOT OK");
    expect(await page.getByText("Simulated", { exact: true }).count()).toBe(1);
    await expectAccessibleInBoth(page);
    await picture(page, "inspection");

    // Judged by a wider tolerance: a new inspection which names what changed.
    const version = { reason: "wider fit", recipe: blockRecipe(2 * DEFECT_MM) };
    await server.call("POST", "/api/v1/recipes/block/versions", version, { "If-Match": '"1"' });
    await page.reload();
    await page.getByLabel("Version").selectOption("2");
    await page.getByRole("button", { name: "Re-evaluate" }).click();
    await page.locator("[data-changed=height]").waitFor();
    expect(await page.locator("[data-changed=height]").textContent()).toBe("height✕ NOT OK✓ OK");
    expect(await page.locator("header .verdict").textContent()).toBe("✓ OK");
    await page.getByRole("link", { name: "the earlier inspection BL-2", exact: true }).click();
    await page.locator("header .verdict.not_ok").waitFor();
    await page.getByRole("link", { name: "Open the point cloud" }).click();
    await page.locator(".cloud-count").waitFor();
    await context.close();
    expect(complaints).toEqual([]);
  },
  STATION_MS,
);

test("inspections fit a phone, and are German for Germans", async () => {
  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, locale: "de-DE" };
  const { page, context, complaints } = await visit(browser, server.url, "#/inspections", phone);
  const narrow = () => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
  await page.locator("[data-inspection]").first().waitFor();
  expect([await narrow(), await englishIn(page, "main")]).toEqual([true, []]);
  await page.locator("tr[data-verdict=not_ok] .name").click();
  await page.locator("[data-characteristic]").first().waitFor();
  expect([await narrow(), await englishIn(page, "main")]).toEqual([true, []]);
  expect(await page.locator("header .verdict").textContent()).toBe("✕ n. i. O.");
  await context.close();
  expect(complaints).toEqual([]);
});
