/**
 * A measurement, not a test: what one frame of Live costs the processor, thread by thread.
 *
 *   LIVE_COST_S=20 npx vitest run --config vitest.browser.config.ts browser/measure/live_cost
 *
 * Starts the program (SHEAF_BIN, with its page) with its simulated station, calibrates it, opens Live and reads the
 * processor time of every thread of the program and of the browser at the start and the end of the given time.
 * LIVE_COST_TRACE=FILE also writes the browser's trace of the five seconds after, LIVE_COST_PROFILE=FILE the script's
 * profile.
 */

import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import type { CDPSession } from "playwright-core";
import { expect, test } from "vitest";
import { launch, NO_GRAPHICS, picture } from "../support/harness";
import { Server } from "../support/server";

const SECONDS = Number(process.env.LIVE_COST_S ?? 0);

/** Code is compiled and caches are filled after so long. */
const WARM_UP_MS = 8000;

/** Time over which the trace and the profile run. */
const TRACED_MS = 5000;

/** Linux counts processor time in hundredths of a second. */
const TICK_MS = 10;

interface Thread {
  name: string;
  ms: number;
}

/** Name, parent and processor time so far, from a `stat` file. */
function stat(path: string): { name: string; parent: number; ms: number } | undefined {
  try {
    const line = readFileSync(path, "utf8");
    const end = line.lastIndexOf(")");
    const fields = line.slice(end + 2).split(" ");
    const ms = TICK_MS * (Number(fields[11]) + Number(fields[12]));
    return { name: line.slice(line.indexOf("(") + 1, end), parent: Number(fields[1]), ms };
  } catch {
    return undefined;
  }
}

/** All threads of the processes that this one started. */
function threads(): Map<string, Thread> {
  const parents = new Map<number, number>();
  for (const entry of readdirSync("/proc")) {
    const told = /^\d+$/.test(entry) ? stat(`/proc/${entry}/stat`) : undefined;
    if (told) parents.set(Number(entry), told.parent);
  }
  const started = (id: number): boolean => {
    const parent = parents.get(id);
    return parent !== undefined && (parent === process.pid || started(parent));
  };
  const found = new Map<string, Thread>();
  for (const id of [...parents.keys()].filter(started)) {
    const name = kindOf(id);
    for (const thread of readdirSync(`/proc/${id}/task`)) {
      const told = stat(`/proc/${id}/task/${thread}/stat`);
      if (told) found.set(`${id}/${thread}`, { name: `${name} · ${told.name}`, ms: told.ms });
    }
  }
  return found;
}

/** The program, or which of the browser's processes. */
function kindOf(id: number): string {
  const line = readFileSync(`/proc/${id}/cmdline`, "utf8").replaceAll("\0", " ");
  if (/ serve /.test(line)) return "sheaf";
  const type = /--type=(\S+)/.exec(line)?.[1] ?? "browser";
  return `chromium ${type === "utility" ? (/--utility-sub-type=(\S+)/.exec(line)?.[1] ?? type) : type}`;
}

test.runIf(SECONDS > 0)("what a frame of Live costs", measure, 1000 * SECONDS + 600_000);

async function measure(): Promise<void> {
  const server = await Server.start();
  const browser = await launch(NO_GRAPHICS);
  try {
    await server.calibrate();
    const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, locale: "en-GB" });
    const page = await context.newPage();
    await page.goto(`${server.url}/#/live`);
    await page.locator(".start-here button").click();
    await page.waitForSelector('.frame-facts [data-fact="rate"]');
    await page.evaluate(() => {
      const place = document.querySelector(".image-area");
      const counted = { drawn: 0 };
      Object.assign(globalThis, { counted });
      if (place) {
        new MutationObserver(() => (counted.drawn += 1)).observe(place, { attributeFilter: ["data-sequence"] });
      }
    });
    const drawn = () =>
      page.evaluate(() => (globalThis as unknown as { counted: { drawn: number } }).counted.drawn);
    const taken = async () => {
      const { frames } = await server.call<{ frames: { taken?: number; arrived?: number } }>(
        "GET",
        "/api/v1/station",
      );
      return frames;
    };
    await page.waitForTimeout(WARM_UP_MS);
    const [before, drawn_before, begun, frames_before] = [
      threads(),
      await drawn(),
      performance.now(),
      await taken(),
    ];
    await page.waitForTimeout(1000 * SECONDS);
    const [after, drawn_after, ended, frames_after] = [threads(), await drawn(), performance.now(), await taken()];
    const seconds = (ended - begun) / 1000;
    const n_drawn = drawn_after - drawn_before;
    console.log(
      `drawn ${(n_drawn / seconds).toFixed(1)} a second; station ${JSON.stringify([frames_before, frames_after])}`,
    );
    tellCosts(before, after, seconds, n_drawn);
    await picture(page, "live-cost");
    const session = await context.newCDPSession(page);
    await profiled(session, () => page.waitForTimeout(TRACED_MS));
    const file = process.env.LIVE_COST_TRACE;
    if (file) {
      await browser.startTracing(page, {
        path: file,
        categories: [
          "devtools.timeline",
          "cc",
          "viz",
          "benchmark",
          "disabled-by-default-devtools.timeline",
          "toplevel",
        ],
      });
      await page.waitForTimeout(TRACED_MS);
      await browser.stopTracing();
    }
    expect(n_drawn).toBeGreaterThan(0);
  } finally {
    await browser.close();
    await server.stop();
  }
}

function tellCosts(
  before: Map<string, Thread>,
  after: Map<string, Thread>,
  seconds: number,
  n_drawn: number,
): void {
  const costs = new Map<string, number>();
  for (const [id, { name, ms }] of after) {
    const spent = ms - (before.get(id)?.ms ?? 0);
    const [program = ""] = name.split(" ");
    for (const key of [program, name]) costs.set(key, (costs.get(key) ?? 0) + spent);
  }
  for (const [name, ms] of [...costs].sort(([, a], [, b]) => b - a)) {
    if (ms < 5 * seconds) continue;
    const share = `${(ms / (10 * seconds)).toFixed(1)} % of a core`;
    console.log(`${share.padStart(17)}, ${(ms / n_drawn).toFixed(2)} ms a drawn frame: ${name}`);
  }
}

async function profiled(session: CDPSession, meanwhile: () => Promise<void>): Promise<void> {
  const file = process.env.LIVE_COST_PROFILE;
  if (!file) return;
  await session.send("Profiler.enable");
  await session.send("Profiler.start");
  await meanwhile();
  const { profile } = await session.send("Profiler.stop");
  writeFileSync(file, JSON.stringify(profile));
}
