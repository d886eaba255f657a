/**
 * The Operate page with the keyboard only: a part is scanned and judged, the next scan stopped, the station reset. And what is
 * left of a scan that was ended early.
 */

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Job, Schemas, Station } from "../../src/api/client";
import { decodeBlocks } from "../../src/stream/protocol";
import {
  calibrated,
  closeTab,
  expectAccessible,
  expectAccessibleInBoth,
  launch,
  picture,
  until,
  visit,
} from "../support/harness";
import { orderPixels } from "../support/pixels";
import type { Server } from "../support/server";

/** A job of the simulated station on a busy machine, ms. */
const JOB_MS = 240_000;

/** All of it on a machine that does other things as well, ms. */
const WALK_MS = 600_000;

let server: Server;
let browser: Browser;

beforeAll(async () => {
  [server, browser] = await Promise.all([calibrated(), launch()]);
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

async function station(): Promise<Station> {
  return await server.call<Station>("GET", "/api/v1/station");
}

/** The newest job. */
async function newestJob(): Promise<Job | undefined> {
  return (await server.call<{ items: Job[] }>("GET", "/api/v1/jobs?limit=1")).items[0];
}

/** Presses Tab, or Shift+Tab, until the focus is on what is wanted. */
async function tabTo(page: Page, wanted: string, key: "Tab" | "Shift+Tab" = "Tab"): Promise<void> {
  for (let presses = 0; presses < 80; presses += 1) {
    const name = await page.evaluate(() => document.activeElement?.textContent?.trim() ?? "");
    if (name === wanted) return;
    await page.keyboard.press(key);
  }
  throw new Error(`no ${wanted} within 80 presses of ${key}`);
}

test(
  "by keys alone a part is scanned and judged, and the next scan is stopped",
  async () => {
    const { page, complaints } = await visit(browser, server.url);
    await page.locator(".bar", { hasText: "Operational.Ready" }).waitFor();
    await page.getByRole("button", { name: "Start scan" }).waitFor();

    // The set-up: fewer rows, as above. Its summary is complete as soon as the plan has been loaded.
    await page.locator(".set-up summary", { hasText: "in steps of" }).waitFor();
    await tabTo(page, (await page.locator(".set-up summary").textContent()) ?? "");
    await page.keyboard.press("Enter");
    for (let presses = 0; presses < 3; presses += 1) await page.keyboard.press("Tab");
    await page.keyboard.press("Control+a");
    await page.keyboard.type("1,0");
    await page.keyboard.press("Tab");
    await page.getByText("in steps of 1 mm").waitFor();

    // A scanner types without looking where the focus is, and ends with Enter.
    await page.keyboard.press("Alt+2");
    await page.getByRole("heading", { name: "Live", level: 1 }).waitFor();
    await page.keyboard.press("Alt+1");
    await page.locator("#serial:focus").waitFor();
    await page.getByRole("button", { name: "Start scan" }).waitFor();
    await page.keyboard.type("K-0001");
    await page.keyboard.press("Enter");
    const verdict = page.locator("[data-outcome]");
    await page.locator(".run-progress[data-job-state=running]", { hasText: "Scan · K-0001" }).waitFor();
    await picture(page, "operate-running");
    await page.getByRole("heading", { name: "K-0001" }).waitFor({ timeout: JOB_MS });
    await page.locator("[data-outcome=ok]").waitFor({ timeout: JOB_MS });
    expect(await verdict.textContent()).toMatch(/OK.*Sphere radius\s*18\.\d{3} mm\s*U = \d+\.\d µm/);
    await page.getByRole("link", { name: /^K-0001, OK, 18\.\d{3} mm/ }).waitFor();
    await picture(page, "operate");
    await expectAccessible(page);

    // Another browser shows the same part with the same verdict.
    const other = await visit(browser, server.url);
    await other.page.getByRole("heading", { name: "K-0001" }).waitFor();
    await other.page.locator("[data-outcome=ok]").waitFor();
    await other.context.close();

    // The next one has so many rows that it is still running when the keys have reached Stop, however slow they are.
    const plan = await server.call<Schemas["MeasurementPlanDto"]>("GET", "/api/v1/measurement-plan");
    await server.call("PUT", "/api/v1/measurement-plan", { ...plan, step_mm: 0.05 }, { "If-Match": "*" });
    await page.getByText("in steps of 0.05 mm").waitFor();
    // It is stopped: back with Shift+Tab to the button in the bar.
    await page.keyboard.type("K-0002");
    await page.keyboard.press("Enter");
    await until("the scan runs", async () => (await station()).state === "Operational.SingleExecution");
    await tabTo(page, "Stop", "Shift+Tab");
    await page.keyboard.press("Enter");
    await until("Halted", async () => (await station()).state === "Halted");
    await until("the job ended without success", async () => {
      const state = (await newestJob())?.state;
      return state === "cancelled" || state === "failed";
    });
    expect((await station()).laser.light).toBe("off");
    await page.getByText("The station was stopped. Check that the area is clear, then reset.").waitFor();
    await picture(page, "operate-stopped");
    await tabTo(page, "Reset");
    await page.keyboard.press("Enter");
    await page.locator(".bar", { hasText: "Operational.Ready" }).waitFor();
    expect(complaints).toEqual([]);
    await closeTab(page);
  },
  WALK_MS,
);

test(
  "the rows of a scan that was ended early are shown as its result",
  async () => {
    // The page of the test before has closed; its control ends with it.
    const control = async () => (await fetch(`${server.url}/api/v1/station/control`)).status;
    await until("control is free", async () => (await control()) === 404);
    // More rows than are taken before the person ends it.
    const asked = { source: { kind: "station" }, from_mm: -20, to_mm: 20, step_mm: 0.05, name: "Ended early" };
    const { id } = await server.call<Job>("POST", "/api/v1/scans", asked);
    const job = () => server.call<Job>("GET", `/api/v1/jobs/${id}`);
    await until("some rows", async () => ((await job()).step?.number ?? 0) > 3, JOB_MS);
    await server.call("POST", `/api/v1/jobs/${id}/cancel`);
    await until("the end", async () => (await job()).state !== "running", JOB_MS);
    const [scan] = (await server.call<Schemas["ListDto_ScanDto"]>("GET", "/api/v1/scans?limit=1")).items;
    expect(scan).toMatchObject({ name: "Ended early", state: "partial", cloud: null });
    const answer = await fetch(`${server.url}/api/v1/scans/${scan?.id}/points?from_block=0`);
    const first = decodeBlocks(await answer.arrayBuffer()).slice(0, 3);
    const few = first.reduce((sum, block) => sum + block.n_points, 0);
    expect(few).toBeGreaterThan(1000);

    const { page, context, complaints } = await visit(browser, server.url, `#/result/${scan?.id}`);
    await page.getByText("The scan was stopped early.").waitFor();
    const shown = page.locator(".cloud-count");
    await until("its points", async () => Number(await shown.getAttribute("data-points")) > few);
    await until("their colours", async () => (await orderPixels(page)).every((n_pixels) => n_pixels > 50));
    await expectAccessibleInBoth(page);
    await picture(page, "result-partial");
    expect(complaints).toEqual([]);
    await context.close();
  },
  JOB_MS,
);
