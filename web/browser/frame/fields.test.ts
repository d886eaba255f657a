/** Number fields: typed text, validation, requests. And the requests of a hidden page. */

import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from "vitest";
import { de } from "../../src/text/de";
import { en } from "../../src/text/en";
import { FakeStation } from "../support/fake_station";
import { launch, NO_GRAPHICS, picture, until, type Visit, visit } from "../support/harness";

let browser: Browser;
let station: FakeStation;
let visitor: Visit;

beforeAll(async () => {
  browser = await launch(NO_GRAPHICS);
});
afterAll(async () => {
  await browser?.close();
});
beforeEach(async () => {
  station = await FakeStation.start();
  station.state = "Operational.Ready";
});
afterEach(async () => {
  await visitor?.context.close();
  await station?.end();
});

async function enter(hash: string): Promise<Visit> {
  visitor = await visit(browser, station.url, hash);
  await visitor.page.locator(".bar", { hasText: "Operational.Ready" }).waitFor();
  return visitor;
}

/** What was sent to an address, without what takes and renews control. */
function sent(request: string): unknown[] {
  return station.commands.filter((one) => one.request === request).map(({ body }) => body);
}

const MOVE = "POST /api/v1/devices/stage/move";

function moveButton(page: Page) {
  return page.getByRole("button", { name: "Move", exact: true });
}

test("a position beyond the travel, or no number, moves nothing, and the button shows the reason", async () => {
  const { page, complaints } = await enter("#/live");
  const field = page.getByLabel("Go to position");
  const cases = [
    ["1500", "allowed: −100 to 100"],
    ["12abc", "not a number"],
    ["5e-2", "not a number"],
    ["abc", "not a number"],
    ["1,500", "ambiguous"],
  ] as const;
  for (const [typed, wrong] of cases) {
    // Key by key: every beginning of it that is a number must not count.
    await field.fill("");
    await field.pressSequentially(typed);
    await page.locator(".command .why", { hasText: wrong }).waitFor();
    expect(await moveButton(page).getAttribute("aria-disabled")).toBe("true");
    expect(await moveButton(page).getAttribute("title")).toContain(wrong);
    await moveButton(page).click({ force: true });
    expect(await field.inputValue()).toBe(typed);
    expect(await field.getAttribute("aria-invalid")).toBe("true");
  }
  await picture(page, "field-wrong");
  expect(sent(MOVE)).toEqual([]);
  await field.fill("15");
  await moveButton(page).click();
  await until("a move", () => sent(MOVE).length > 0);
  expect(sent(MOVE)).toEqual([{ target_mm: 15 }]);
  // A command carries the lease that it took.
  expect(station.commands.find((one) => one.request === MOVE)?.control).toBe("lease");
  expect(complaints).toEqual([]);
});

test("a value is applied on Enter and on leaving the field, not on every key; Escape restores it", async () => {
  const { page, complaints } = await enter("#/scan");
  const kept = () => page.evaluate(() => localStorage.getItem("sheaf.scan_to_mm"));
  const field = page.getByLabel("To", { exact: true });
  await field.fill("");
  await field.pressSequentially("35");
  expect(await kept()).toBe("20");
  await field.press("Escape");
  expect(await field.inputValue()).toBe("20");
  await field.fill("35");
  await field.press("Enter");
  expect(await kept()).toBe("35");
  await field.fill("36,5");
  await page.getByLabel("From", { exact: true }).focus();
  expect(await kept()).toBe("36.5");
  expect(await field.inputValue()).toBe("36.5");
  expect(complaints).toEqual([]);
});

test("a wrong field keeps a scan from starting, and its plan from being shown", async () => {
  const { page, complaints } = await enter("#/scan");
  const start = page.getByRole("button", { name: "Start scan" });
  const step = page.getByLabel("Step", { exact: true });
  await step.fill("0");
  await page.locator(".scan-start .why", { hasText: "Step: allowed: 0.001 to ∞" }).waitFor();
  await page.locator("[data-plan=refused]", { hasText: "Step: allowed" }).waitFor();
  await start.click({ force: true });
  // The field that is wrong is gone with its mode, and with it what it blocks.
  await page.getByRole("radio").nth(1).check();
  await page.locator(".scan-start .why", { hasText: "Step" }).waitFor({ state: "detached" });
  expect(sent("POST /api/v1/scans")).toEqual([]);
  expect(complaints).toEqual([]);
});

test("an invalid exposure blocks the camera's buttons until it is corrected or discarded", async () => {
  const { page, complaints } = await enter("#/live");
  const field = page.getByLabel("Exposure time");
  await until("settings", async () => (await field.inputValue()) === "2000");
  await field.fill("5e3");
  for (const name of ["Apply", "Halve exposure", "Double exposure"]) {
    const button = page.getByRole("button", { name, exact: true });
    expect(await button.getAttribute("aria-disabled"), name).toBe("true");
    await button.click({ force: true });
  }
  await field.press("Enter");
  await page.getByRole("button", { name: "Discard" }).click();
  expect(await field.inputValue()).toBe("2000");
  expect(sent("PATCH /api/v1/devices/camera/settings")).toEqual([]);
  await field.fill("5000");
  await field.press("Enter");
  await until("a change", () => sent("PATCH /api/v1/devices/camera/settings").length > 0);
  expect(sent("PATCH /api/v1/devices/camera/settings")).toEqual([{ exposure_us: 5000 }]);
  expect(complaints).toEqual([]);
});

test("after Stop the page offers no job before a reset", async () => {
  const { page, complaints } = await enter("#/scan");
  await page.locator("[data-plan=there]").waitFor();
  const start = page.getByRole("button", { name: "Start scan" });
  expect(await start.getAttribute("aria-disabled")).toBe(null);
  station.enter("Halted");
  await page.locator(".scan-start .why", { hasText: "reset it first" }).waitFor();
  await start.click({ force: true });
  await page.locator(".banners").getByRole("button", { name: "Reset" }).click();
  await page.locator(".scan-start .why").waitFor({ state: "detached" });
  expect(sent("POST /api/v1/scans")).toEqual([]);
  expect(complaints).toEqual([]);
});

test("a page that crashes offers a reload, and Stop still works", async () => {
  station.plan = { no: "plan" };
  const { page, complaints } = await enter("#/scan");
  await page.locator(".problem", { hasText: "This page has crashed" }).waitFor();
  await page.locator(".bar .stop").click();
  await page.locator(".bar", { hasText: "Halted" }).waitFor();
  await page.getByRole("link", { name: "Help" }).click();
  await page.getByRole("heading", { name: "Help", level: 1 }).waitFor();
  await page.goto(`${station.url}/#/scan`);
  const reloaded = page.waitForEvent("load");
  await page.getByRole("button", { name: "Reload" }).click();
  await reloaded;
  expect(complaints).toEqual([]);
});

/** Lets the page believe that it is hidden, or seen. */
async function setVisibility(page: Page, state: "hidden" | "visible"): Promise<void> {
  await page.evaluate((state) => {
    Object.defineProperty(document, "visibilityState", { configurable: true, get: () => state });
    document.dispatchEvent(new Event("visibilitychange"));
  }, state);
}

test("a hidden page is no viewer, and subscribes again over the same connection when it is shown", async () => {
  const { page, complaints } = await enter("#/live");
  const subscribed = (stream: string) =>
    station.texts.filter(({ op, streams }) => op === "subscribe" && JSON.stringify(streams).includes(stream))
      .length;
  const left = (stream: string) =>
    station.texts.some(({ op, streams }) => op === "unsubscribe" && JSON.stringify(streams).includes(stream));
  await until("viewer", () => subscribed("image") > 0 && subscribed("profile") > 0);
  const before = [subscribed("image"), subscribed("profile")];
  await setVisibility(page, "hidden");
  await until("no viewer", () => left("image") && left("profile"));
  expect(left("state")).toBe(false);
  await setVisibility(page, "visible");
  await until(
    "viewer again",
    () => subscribed("image") > (before[0] ?? 0) && subscribed("profile") > (before[1] ?? 0),
  );
  expect(station.n_connections).toBe(1);
  expect(complaints).toEqual([]);
});

test("without a connection the page does not claim control", async () => {
  const { page, complaints } = await enter("#/help");
  await page.getByRole("button", { name: "No one in control" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Take control", exact: true }).click();
  await page.getByRole("button", { name: "You are in control" }).waitFor();
  station.silent = true;
  await page.getByRole("button", { name: "Control unknown" }).waitFor();
  expect(await page.getByText("You are in control").count()).toBe(0);
  station.silent = false;
  await page.getByRole("button", { name: "You are in control" }).waitFor();
  expect(complaints).toEqual([]);
});

test.each(["en-GB", "de-DE"])(
  "laser, interlock and link stay in the bar at the width of a phone (%s)",
  async (locale) => {
    const words = locale === "en-GB" ? en.frame : de.frame;
    visitor = await visit(browser, station.url, "#/help", { viewport: { width: 390, height: 844 }, locale });
    const { page, complaints } = visitor;
    await page.locator(".bar", { hasText: "Operational.Ready" }).waitFor();
    const stop = await page.locator(".bar .stop").boundingBox();
    for (const [item, shown] of [
      ["laser", words.light.off ?? ""],
      ["interlock", words.interlock_closed],
      ["link", words.link_live],
    ] as const) {
      const text = page.locator(`.bar .${item} strong`, { hasText: shown });
      await text.waitFor();
      const box = await text.boundingBox();
      expect((box?.x ?? 0) + (box?.width ?? 999), item).toBeLessThanOrEqual(stop?.x ?? 0);
    }
    expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
    await picture(page, `phone-bar-${locale}`);
    expect(complaints).toEqual([]);
  },
);
