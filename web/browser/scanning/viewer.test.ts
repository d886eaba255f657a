/** The viewer's tools on two scans of the simulated station: shading, full screen, region, cut, comparison. */

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { HEIGHT_MM, placeBlock } from "../support/block";
import { englishIn } from "../support/german";
import { calibrated, expectAccessibleInBoth, launch, picture, until, visit, wholeCloud } from "../support/harness";
import type { Server } from "../support/server";

/** The second block is lower by this, µm: many times the noise of a point. */
const LOWER_UM = 300;

/** A distance picked by keys in a cut of points with noise, mm. */
const PICKED_OFF_MM = 0.1;

let server: Server;
let browser: Browser;
const scans: string[] = [];

beforeAll(async () => {
  [server, browser] = await Promise.all([calibrated(), launch()]);
  for (const height_mm of [HEIGHT_MM, HEIGHT_MM - LOWER_UM / 1000]) {
    await placeBlock(server, height_mm);
    scans.push(await server.scan());
  }
}, 600_000);

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

const button = (page: Page, name: string) => page.getByRole("button", { name, exact: true });

test("the cloud takes most of the page; full screen leaves Stop within reach", async () => {
  const { page, context, complaints } = await visit(browser, server.url, `#/result/${scans[0]}`);
  await wholeCloud(page);
  const stage = await page.locator(".cloud-stage").boundingBox();
  const main = await page.locator("main").boundingBox();
  const fraction = ((stage?.width ?? 0) * (stage?.height ?? 0)) / ((main?.width ?? 1) * (main?.height ?? 1));
  expect(fraction).toBeGreaterThan(0.5);
  await expectAccessibleInBoth(page);
  await picture(page, "result-viewer");

  await page.keyboard.press("F11");
  await page.locator(".cloud-view.full").waitFor();
  const stop = await page.locator(".stop").boundingBox();
  if (!stop) throw new Error("no Stop");
  const at_stop = { x: stop.x + stop.width / 2, y: stop.y + stop.height / 2 };
  expect(
    await page.evaluate(({ x, y }) => document.elementFromPoint(x, y)?.closest(".stop") !== null, at_stop),
  ).toBe(true);
  await picture(page, "viewer-full");
  await button(page, "Full screen").click();
  await page.locator(".cloud-view.full").waitFor({ state: "detached" });
  expect(complaints).toEqual([]);
  await context.close();
});

test("the region hides what is outside, and a tool measures what is inside", async () => {
  const { page, context, complaints } = await visit(browser, server.url, `#/result/${scans[0]}`);
  await wholeCloud(page);
  await button(page, "Region").click();
  await button(page, "Select what is in view").click();
  const inside = page.locator("[data-region-points]");
  const all = Number(await inside.getAttribute("data-region-points"));
  // The top of the block alone.
  const region = page.getByRole("region", { name: "Region" });
  await inside.click();
  const z_from = Number.parseFloat(await region.getByLabel("z from").inputValue());
  await region.getByLabel("z to").fill(String(z_from + 1));
  await page.keyboard.press("Enter");
  await until("fewer points", async () => Number(await inside.getAttribute("data-region-points")) < all / 2);
  await page.getByLabel("Hide points outside the region").check();
  await page.locator(".measure-form select").selectOption("flatness");
  await page.getByRole("region", { name: "Measurements" }).getByRole("button", { name: "Measure" }).click();
  await page.locator("tr[data-tool=flatness]").waitFor();
  await picture(page, "viewer-region");
  expect(complaints).toEqual([]);
  await context.close();
});

test("a cut shows its points; two of them, picked by keys, have a distance", async () => {
  const { page, context, complaints } = await visit(browser, server.url, `#/result/${scans[0]}`);
  await wholeCloud(page);
  await button(page, "Cut").click();
  const plot = page.getByRole("application", { name: "Points in the cut" });
  await plot.focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  for (let step = 0; step < 3; step++) await page.keyboard.press("Shift+ArrowRight");
  await page.keyboard.press("Enter");
  const found = page.locator("[data-cut-distance]");
  await found.waitFor();
  const distance_mm = Number(await found.getAttribute("data-cut-distance"));
  expect(distance_mm).toBeGreaterThan(PICKED_OFF_MM);
  await expectAccessibleInBoth(page);
  await picture(page, "viewer-cut");
  await button(page, "across x").click();
  await page.getByLabel("Hide points with larger x").check();
  await picture(page, "viewer-cut-x");
  expect(complaints).toEqual([]);
  await context.close();
});

test("two scans are seen side by side, and their difference is that of the blocks", async () => {
  const { page, context, complaints } = await visit(browser, server.url, `#/result/${scans[1]}`);
  await page.getByRole("link", { name: "Compare" }).click();
  await page.locator(".compare .cloud-canvas canvas").nth(1).waitFor();
  const all = await wholeCloud(page);
  expect(await page.locator(".compare .cloud-canvas canvas").first().getAttribute("data-points")).not.toBe("0");
  await picture(page, "compare-side");
  await expectAccessibleInBoth(page);

  await button(page, "Difference").click();
  const second = page.locator(".second");
  await until("the difference", async () => (await second.getByLabel("Colour").inputValue()) === "deviation");
  await second.getByLabel("Hide points outside the range").check();
  const shown = async (low: number, high: number) => {
    // Which end is entered first does not matter: neither crosses the other.
    await second.getByLabel("From", { exact: true }).fill("-5000");
    await page.keyboard.press("Enter");
    await second.getByLabel("To", { exact: true }).fill(String(high));
    await page.keyboard.press("Enter");
    await second.getByLabel("From", { exact: true }).fill(String(low));
    await page.keyboard.press("Enter");
    const text = (await second.locator(".cloud-count").textContent()) ?? "";
    return Number((text.split(" of ")[0] ?? "").replace(/\D/g, ""));
  };
  const lower = await shown(-LOWER_UM - 60, -LOWER_UM + 60);
  await picture(page, "compare-difference");
  const same = await shown(-60, 60);
  const higher = await shown(LOWER_UM - 60, LOWER_UM + 60);
  // The top is a sixtieth of the scanned area, the table most of the rest.
  expect(lower).toBeGreaterThan(all / 120);
  expect(same).toBeGreaterThan(all / 4);
  expect(higher).toBeLessThan(lower / 5);
  expect(complaints).toEqual([]);
  await context.close();
});

test("the tools fit a phone, and are German for Germans", async () => {
  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, locale: "de-DE" };
  const { page, context, complaints } = await visit(browser, server.url, `#/result/${scans[0]}`, phone);
  const narrow = () => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
  await wholeCloud(page);
  await button(page, "Bereich").click();
  await button(page, "Sichtbares auswählen").click();
  expect([await narrow(), await englishIn(page, ".cloud-view")]).toEqual([true, []]);
  await picture(page, "viewer-phone-region");
  await button(page, "Schnitt").click();
  expect([await narrow(), await englishIn(page, ".cloud-view")]).toEqual([true, []]);
  await picture(page, "viewer-phone-cut");
  await page.goto(`${server.url}/#/compare/${scans[1]}?with=${scans[0]}&as=side`);
  await wholeCloud(page);
  expect([await narrow(), await englishIn(page, "main")]).toEqual([true, []]);
  await picture(page, "compare-phone");
  expect(complaints).toEqual([]);
  await context.close();
});
