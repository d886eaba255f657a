/** Stop arrives despite network problems: full connection pools, lines without responses. */

import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from "vitest";
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
  visitor = await visit(browser, station.url, "#/help");
  await visitor.page.locator(".bar", { hasText: "Operational.SingleExecution" }).waitFor();
});
afterEach(async () => {
  await visitor?.context.close();
  await station?.end();
});

/** As many stalled downloads as a browser has connections. */
async function saturate(page: Page): Promise<void> {
  await page.evaluate(() => {
    for (let n = 0; n < 6; n++) void fetch(`/stalled?${n}`).catch(() => undefined);
  });
  // A seventh request waits in the browser.
  const answered = await page.evaluate(() =>
    Promise.race([
      fetch("/api/v1/probe").then(() => true),
      new Promise<boolean>((late) => setTimeout(() => late(false), 1000)),
    ]),
  );
  expect(answered).toBe(false);
}

async function press(page: Page): Promise<void> {
  await page.locator(".bar .stop").click();
}

test("six stalled downloads do not delay Stop", async () => {
  const { page, complaints } = visitor;
  await saturate(page);
  await press(page);
  await page.locator(".bar", { hasText: "Halted" }).waitFor();
  expect(station.stops).not.toContain("post");
  expect(station.stops).toContain("websocket");
  await page.locator(".stop", { hasText: /^Stop$/ }).waitFor();
  expect(await page.getByText("No response to Stop").count()).toBe(0);
  expect(complaints).toEqual([]);
});

test("on a dead line Stop is repeated with a message, and arrives when the line is back", async () => {
  const { page, complaints } = visitor;
  station.silent = true;
  await press(page);
  await page.locator(".banners .problem", { hasText: "No response to Stop yet" }).waitFor();
  await page.locator(".stop", { hasText: "Stopping" }).waitFor();
  await picture(page, "stop-unanswered");
  expect(station.stops).toEqual([]);
  station.silent = false;
  await page.locator(".bar", { hasText: "Halted" }).waitFor();
  await page.locator(".banners .problem").waitFor({ state: "detached" });
  await page.locator(".stop", { hasText: /^Stop$/ }).waitFor();
  expect(station.stops.length).toBeGreaterThan(0);
  expect(complaints).toEqual([]);
});

test("requests that hung when the station stopped do not stop it again after a reset", async () => {
  const { page, complaints } = visitor;
  station.silent = true;
  await press(page);
  await page.locator(".banners .problem", { hasText: "No response to Stop yet" }).waitFor();
  station.silent = false;
  await page.locator(".stop", { hasText: /^Stop$/ }).waitFor();
  const n_stops = station.stops.length;
  await page.locator(".banners").getByRole("button", { name: "Reset" }).click();
  await page.locator(".bar", { hasText: "Operational.Ready" }).waitFor();
  // Longer than between several attempts.
  await page.waitForTimeout(3000);
  expect(station.stops).toHaveLength(n_stops);
  expect(station.state).toBe("Operational.Ready");
  expect(complaints).toEqual([]);
});

test("a Stop whose answer takes seconds is not given up", async () => {
  const { page, complaints } = visitor;
  await saturate(page);
  station.silent = true;
  await press(page);
  await page.locator(".banners .problem", { hasText: "No response to Stop yet" }).waitFor();
  await page.waitForTimeout(3000);
  await page.locator(".stop", { hasText: "Stopping" }).waitFor();
  station.silent = false;
  await until("Halted", () => station.state === "Halted");
  await page.locator(".bar", { hasText: "Halted" }).waitFor();
  expect(complaints).toEqual([]);
});
