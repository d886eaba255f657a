/** The operator's page with recipes: a scanner types serial numbers, parts get verdicts, the queue is held. */

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Schemas } from "../../src/api/client";
import { blockRecipe, DEFECT_MM, HEIGHT_MM, placeBlock } from "../support/block";
import { englishIn } from "../support/german";
import {
  calibrated,
  expectAccessible,
  expectAccessibleInBoth,
  launch,
  NO_GRAPHICS,
  picture,
  until,
  visit,
} from "../support/harness";
import type { Server } from "../support/server";

/** Tests that calibrate or inspect, on a busy machine. */
const STATION_MS = 300_000;

let server: Server;
let browser: Browser;

beforeAll(async () => {
  [server, browser] = await Promise.all([calibrated(), launch(NO_GRAPHICS)]);
}, 600_000);

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

/** A barcode scanner: characters and Enter, wherever the focus is. */
async function scanned(page: Page, serial: string): Promise<void> {
  await page.keyboard.type(serial);
  await page.keyboard.press("Enter");
}

const inspections = async () => {
  const list = await server.call<Schemas["ListDto_InspectionDto"]>("GET", "/api/v1/inspections");
  return list.items.map(({ serial, recipe, order }) => [serial, `${recipe.id}@${recipe.version}`, order ?? null]);
};

const narrow = (page: Page) => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);

test("without a recipe the page scans, and says where recipes are made", async () => {
  const { page, context, complaints } = await visit(browser, server.url);
  await page.getByText("There is no recipe yet").waitFor();
  await page.getByRole("button", { name: "Start scan" }).waitFor();
  expect(await page.locator(".recipe-bar").count()).toBe(0);
  await page.getByRole("link", { name: "API", exact: false }).last().click();
  await page.locator("#help-api").waitFor();
  await context.close();
  expect(complaints).toEqual([]);
});

test(
  "a scanned serial number starts an inspection; the verdict is shown in words with its worst characteristics",
  async () => {
    const recipe = blockRecipe(DEFECT_MM / 2);
    await server.call("POST", "/api/v1/recipes", { id: "block", reason: "first article", recipe });
    await placeBlock(server, HEIGHT_MM);
    const { page, context, complaints } = await visit(browser, server.url);
    const start = page.getByRole("button", { name: "Start inspection" });
    await start.waitFor();
    await page.getByText("Scan or type the serial number of the part.").waitFor();
    await expectAccessibleInBoth(page);
    await picture(page, "operate-inspect-idle");
    // Without a serial number Enter starts nothing.
    await page.keyboard.press("Enter");
    expect(await page.getByRole("combobox", { name: "Recipe" }).inputValue()).toBe("block");

    // The list has the focus: a scan neither changes it nor is lost.
    await page.getByRole("combobox", { name: "Recipe" }).focus();
    await scanned(page, "nBL-1");
    await page.locator(".run-progress").waitFor();
    expect(await page.getByRole("combobox", { name: "Recipe" }).inputValue()).toBe("block");
    expect(await page.locator("[aria-current=step]").count()).toBe(1);
    await page.locator(".last-result", { hasText: "The part is being inspected." }).waitFor();
    // The next serial number during the inspection starts nothing, and the one after replaces it.
    await scanned(page, "BL-2");
    await scanned(page, "BL-3");
    expect(await page.locator("#serial").inputValue()).toBe("BL-3");
    await page.locator("[aria-current=step]", { hasText: "Scanning" }).waitFor();
    await picture(page, "operate-inspect-running");
    await page.locator("[data-outcome=ok]").waitFor();
    const result = page.locator(".last-result");
    expect(await result.locator(".part-verdict").textContent()).toBe("✓ OK");
    const bars = result.locator("[data-characteristic=height]");
    expect(await bars.textContent()).toMatch(/height.*Step height.*8\.\d{3} mm.*U = \d+\.\d µm.*OK/);
    const label = await bars.locator("svg").getAttribute("aria-label");
    expect(label).toMatch(/^lower limit 8\.870 mm, value 8\.\d{3} mm, upper limit 8\.930 mm$/);
    // The characteristic without limits has a value and no bar.
    expect(await result.locator("[data-characteristic=flat] svg").count()).toBe(0);
    expect(await inspections()).toEqual([["nBL-1", "block@1", null]]);
    await expectAccessibleInBoth(page);
    await picture(page, "operate-inspect-ok");

    // The next part has a defect; the field still has the focus.
    await placeBlock(server, HEIGHT_MM - DEFECT_MM);
    await page.getByLabel("Production order").fill("4711");
    await page.keyboard.press("Enter");
    await page.locator("#serial:focus").fill("BL-3");
    await page.keyboard.press("Enter");
    await page.locator("[data-outcome=not_ok]").waitFor();
    expect(await result.locator(".part-verdict").textContent()).toBe("✕ NOT OK");
    await expectAccessibleInBoth(page);
    await picture(page, "operate-inspect-not-ok");
    expect(await inspections()).toEqual([
      ["BL-3", "block@1", "4711"],
      ["nBL-1", "block@1", null],
    ]);
    const parts = page.locator("[data-part]");
    await until("two parts", async () => (await parts.count()) === 2);
    expect(await parts.first().textContent()).toMatch(/✕BL-3NOT OK/);
    await parts.first().click();
    await page.locator("[data-characteristic=height]").waitFor();
    expect(page.url()).toContain("#/inspections/");
    await context.close();
    expect(complaints).toEqual([]);
  },
  STATION_MS,
);

test(
  "a serial number that was inspected before is asked about, and a scanner's Enter does not answer yes",
  async () => {
    const { page, context, complaints } = await visit(browser, server.url);
    await page.getByRole("button", { name: "Start inspection" }).waitFor();
    await scanned(page, "BL-3");
    const dialog = page.getByRole("dialog", { name: "Same serial number" });
    await dialog.getByText("BL-3 was inspected on").waitFor();
    await expectAccessible(page);
    await picture(page, "operate-inspect-repeated");
    await scanned(page, "BL-3");
    await dialog.waitFor({ state: "detached" });
    expect((await inspections()).length).toBe(2);
    await page.locator("#serial:focus").waitFor();
    await page.keyboard.press("Enter");
    await dialog.getByRole("button", { name: "Inspect again" }).click();
    await dialog.waitFor({ state: "detached" });
    await until("three inspections", async () => (await inspections()).length === 3, STATION_MS);
    await context.close();
    expect(complaints).toEqual([]);
  },
  STATION_MS,
);

test(
  "the queue is held before the next part and resumed, across browsers; an older version is named",
  async () => {
    const version = { reason: "wider fit", recipe: blockRecipe(2 * DEFECT_MM) };
    await server.call("POST", "/api/v1/recipes/block/versions", version, { "If-Match": '"1"' });
    const { page, context, complaints } = await visit(browser, server.url);
    await page.getByLabel("Version").selectOption("1");
    await page.getByText("Not the newest version, which is 2.").waitFor();
    await page.getByLabel("Reason for the hold").fill("new fixture");
    await page.getByRole("button", { name: "Hold queue" }).click();
    await page.getByText("Queue on hold.").waitFor();
    await page.getByText("Reason: new fixture").waitFor();
    await page.locator("#serial").fill("BL-4");
    await page.keyboard.press("Enter");
    await page.getByText("The queue is on hold. Resume it to inspect parts.").waitFor();
    // An order of another system waits, and says so.
    const job = await server.call<Schemas["JobDto"]>("POST", "/api/v1/inspections", {
      recipe: "block",
      serial: "MES-1",
    });
    await page.getByText("1 part waiting.").waitFor();
    await page.locator("[aria-current=step]", { hasText: "Waiting" }).waitFor();
    await expectAccessibleInBoth(page);
    await picture(page, "operate-inspect-held");
    const other = await visit(browser, server.url);
    await other.page.getByRole("button", { name: "Resume queue" }).click();
    await page.getByText("Queue running.").waitFor();
    await other.context.close();
    const state = async () => (await server.call<Schemas["JobDto"]>("GET", `/api/v1/jobs/${job.id}`)).state;
    await until("the waiting part is inspected", async () => (await state()) === "succeeded", STATION_MS);
    // The chosen version is remembered in this browser, and used.
    await page.reload();
    await page.getByRole("button", { name: "Start inspection" }).waitFor();
    // The name of the person is sent with the inspection.
    await page.getByText("No operator name is sent with the inspection.").waitFor();
    await page.getByRole("link", { name: "Enter a name" }).click();
    await page.getByLabel("Your name, as others see it").fill("Anna");
    await page.goBack();
    await page.getByText("Sent with the inspection: operator Anna.").waitFor();
    await page.locator("#serial").fill("BL-5");
    await page.getByRole("button", { name: "Start inspection" }).click();
    await until("BL-5", async () => (await inspections())[0]?.[0] === "BL-5", STATION_MS);
    expect((await inspections())[0]).toEqual(["BL-5", "block@1", null]);
    const list = await server.call<Schemas["ListDto_InspectionDto"]>("GET", "/api/v1/inspections?limit=1");
    expect(list.items[0]?.attributes).toEqual({ operator: "Anna" });
    // Back to a scan without a recipe.
    await page.getByRole("combobox", { name: "Recipe" }).selectOption("none: scan only");
    await page.getByRole("button", { name: "Start scan" }).waitFor();
    await context.close();
    expect(complaints).toEqual([]);
  },
  STATION_MS,
);

test(
  "the page fits a phone, is German for Germans, and shows the colours of a light tower on request",
  async () => {
    const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, locale: "de-DE" };
    const { page, context, complaints } = await visit(browser, server.url, "", phone);
    await page.getByRole("button", { name: "Prüfung starten" }).waitFor();
    await page.locator(".last-result [data-characteristic]").first().waitFor();
    expect([await narrow(page), await englishIn(page, "main")]).toEqual([true, []]);
    await picture(page, "operate-inspect-phone");
    // Stop is within reach at the end of the page, too.
    await page.locator("[data-part]").last().scrollIntoViewIfNeeded();
    const stop = await page.getByRole("button", { name: "Stop" }).boundingBox();
    expect(stop && stop.y >= 0 && stop.y + stop.height <= 844).toBe(true);
    await page.goto(`${server.url}/#/settings`);
    await page.getByLabel(/Signalsäule/).check();
    await page.goto(`${server.url}/#/operate`);
    await page.locator(".part-verdict.light-tower").waitFor();
    await page.setViewportSize({ width: 1280, height: 800 });
    await page.locator("#serial").fill("BL-9");
    await expectAccessibleInBoth(page);
    await picture(page, "operate-inspect-german");
    await page.locator("#serial").press("Enter");
    await page.locator("[aria-current=step]", { hasText: "Scannen" }).waitFor();
    expect(await englishIn(page, "main")).toEqual([]);
    await page.locator(".last-result h2", { hasText: "BL-9" }).waitFor();
    await page.locator(".part-verdict").waitFor();
    await page.locator("#serial").fill("BL-9");
    await page.locator("#serial").press("Enter");
    await page.getByRole("dialog").waitFor();
    expect(await englishIn(page, "dialog")).toEqual([]);
    await context.close();
    expect(complaints).toEqual([]);
  },
  STATION_MS,
);
