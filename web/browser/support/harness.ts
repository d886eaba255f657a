/** Debian's Chromium without windows looking at the program. */

import { mkdirSync } from "node:fs";
import { join } from "node:path";
import AxeBuilder from "@axe-core/playwright";
import { type Browser, type BrowserContext, chromium, type Page } from "playwright-core";
import { expect, inject } from "vitest";
import { ROOT, Server } from "./server";

/** A cloud that has so many points this many times in a row is complete. */
const STILL = 12;

/** Longest time until a page shows what it should on a busy machine. */
const SEEN_WITHIN_MS = 120_000;

const CHROMIUM = process.env.SHEAF_CHROMIUM ?? "/usr/bin/chromium-headless-shell";

/** Screenshots for the README and the documents are written here; check each of them. */
export const PICTURES = process.env.SHEAF_PICTURES ?? join(ROOT, "target/browser");

declare module "vitest" {
  interface ProvidedContext {
    /** The data of a calibrated station, for every file of a run. */
    calibrated: string;
  }
}

/** A station with an active calibration, for tests that are about something else. */
export async function calibrated(): Promise<Server> {
  return await Server.onCopyOf(inject("calibrated"));
}

/** WebGL2, drawn by the processor; the rest of the page is painted directly, in a sixth less time. */
const SOFTWARE_GRAPHICS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"];
/** For pages without WebGL: their canvases are painted directly. */
export const NO_GRAPHICS = ["--disable-gpu"];

export async function launch(graphics = SOFTWARE_GRAPHICS): Promise<Browser> {
  return await chromium.launch({
    executablePath: CHROMIUM,
    args: ["--no-sandbox", "--disable-dev-shm-usage", ...graphics],
  });
}

export interface Visit {
  page: Page;
  context: BrowserContext;
  /** What the page complained about; a test ends with none. */
  complaints: string[];
}

/** Opens a page of the station as a new user: no stored settings, English, light theme. */
export async function visit(browser: Browser, url: string, hash = "", options = {}): Promise<Visit> {
  const context = await browser.newContext({
    viewport: { width: 1280, height: 800 },
    locale: "en-GB",
    colorScheme: "light",
    reducedMotion: "reduce",
    ...options,
  });
  context.setDefaultTimeout(SEEN_WITHIN_MS);
  const page = await context.newPage();
  const complaints: string[] = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("console", (message) => {
    // A server that is away on purpose, or that refuses with a problem, is told on the page.
    const network = /Failed to load resource|WebSocket connection|ERR_CONNECTION/.test(message.text());
    if (message.type() === "error" && !network) complaints.push(message.text());
  });
  const answer = await page.goto(`${url}/${hash}`);
  if (!answer?.ok()) throw new Error(`no page at ${url}: ${await answer?.text()}`);
  await page.waitForSelector(".frame");
  return { page, context, complaints };
}

/** Closes a page as a person closes a tab: it still learns of it, and releases control. */
export async function closeTab(page: Page): Promise<void> {
  const closed = page.waitForEvent("close");
  await page.close({ runBeforeUnload: true });
  await closed;
}

/** Demands that the page has no violation of WCAG 2.2 A and AA that axe knows. */
export async function expectAccessible(page: Page): Promise<void> {
  const tags = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"];
  // The page has no iframes, so the other mode, which opens an extra page, is not needed.
  const { violations } = await new AxeBuilder({ page }).withTags(tags).setLegacyMode().analyze();
  const told = violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).join(" | ")}`);
  expect(told).toEqual([]);
}

/** Checks both themes and leaves the page in the light theme. */
export async function expectAccessibleInBoth(page: Page): Promise<void> {
  for (const colorScheme of ["dark", "light"] as const) {
    await page.emulateMedia({ colorScheme });
    await page.locator(`html[data-theme=${colorScheme}]`).waitFor();
    await expectAccessible(page);
  }
}

/** Writes a screenshot. */
export async function picture(page: Page, name: string): Promise<void> {
  mkdirSync(PICTURES, { recursive: true });
  await page.screenshot({ path: join(PICTURES, `${name}.png`) });
}

/** Waits for a condition outside of the page. */
export async function until(
  what: string,
  condition: () => Promise<boolean> | boolean,
  within_ms = 60_000,
): Promise<void> {
  const begun = Date.now();
  while (!(await condition())) {
    if (Date.now() - begun > within_ms) throw new Error(`not within ${within_ms} ms: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

/** The number of points of the newest cloud, once it does not change any more. */
export async function wholeCloud(page: Page): Promise<number> {
  const canvas = page.locator(".cloud-canvas canvas").last();
  let [n_points, n_same] = [0, 0];
  await until("the whole cloud", async () => {
    const before = n_points;
    n_points = Number(await canvas.getAttribute("data-points"));
    n_same = n_points === before ? n_same + 1 : 0;
    return n_points > 0 && n_same >= STILL;
  });
  return n_points;
}
