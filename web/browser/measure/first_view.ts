/**
 * How long until a person who opens the page can act: `SHEAF_BIN=… npx vite-node browser/measure/first_view.ts`.
 *
 * Starts the program (in release: a debug build reads the page from disk) on loopback and opens the page in fresh
 * browser contexts, nothing cached. Counted from the start of the navigation to the first frame in which Stop is on the
 * screen, enabled and not covered, and the state of the station is told. Prints every visit, median and longest.
 */

import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { chromium } from "playwright-core";

const VISITS = Number(process.env.VISITS ?? 10);

/** What is promised, on loopback. */
const PROMISED_MS = 1000;

const { SHEAF_BIN = "../target/release/sheaf", ...environment } = process.env;
const folder = mkdtempSync(join(tmpdir(), "sheaf-first-view-"));
const server = spawn(SHEAF_BIN, ["serve", "--listen", "127.0.0.1:0", "--data", join(folder, "data")], {
  stdio: ["ignore", "pipe", "ignore"],
  env: Object.fromEntries(Object.entries(environment).filter(([name]) => !name.startsWith("SHEAF_"))),
});
const url = await new Promise<string>((found) => {
  createInterface({ input: server.stdout }).on("line", (line) => {
    const url = /http:\/\/[^\s/]+/.exec(line)?.[0];
    if (url) found(url);
  });
});
const browser = await chromium.launch({
  executablePath: process.env.SHEAF_CHROMIUM ?? "/usr/bin/chromium-headless-shell",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"],
});

/** Looks at every frame; its time is counted from the start of the navigation. */
const WATCH = `(() => {
  const look = () => {
    const stop = document.querySelector("button.stop");
    const box = stop?.getBoundingClientRect();
    const seen = box && document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
    const state = document.querySelector(".bar")?.textContent ?? "";
    const usable = stop && !stop.disabled && (seen === stop || stop.contains(seen));
    if (usable && /Operational|Preoperational|Halted|Error/.test(state)) window.usable_ms = performance.now();
    else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
})()`;

interface Seen {
  usable_ms: number;
  first_paint_ms: number;
  loaded_bytes: number;
}

async function visited(): Promise<Seen> {
  const context = await browser.newContext({
    bypassCSP: true,
    viewport: { width: 1280, height: 800 },
    locale: "en-GB",
  });
  const page = await context.newPage();
  await page.addInitScript(WATCH);
  await page.goto(url);
  await page.waitForFunction("window.usable_ms !== undefined");
  const seen: Seen = await page.evaluate(() => {
    const loaded = performance.getEntriesByType("resource") as PerformanceResourceTiming[];
    const paint = performance.getEntriesByName("first-contentful-paint")[0];
    const { usable_ms } = window as unknown as { usable_ms: number };
    const loaded_bytes = loaded.reduce((sum, one) => sum + one.encodedBodySize, 0);
    return { usable_ms, first_paint_ms: paint?.startTime ?? Number.NaN, loaded_bytes };
  });
  await context.close();
  return seen;
}

const times_ms: number[] = [];
for (let visit = 0; visit < VISITS; visit++) {
  const { usable_ms, first_paint_ms, loaded_bytes } = await visited();
  times_ms.push(usable_ms);
  const told = `first paint ${first_paint_ms.toFixed(0)} ms, ${(loaded_bytes / 1024).toFixed(0)} KiB loaded`;
  console.log(`visit ${visit + 1}: usable after ${usable_ms.toFixed(0)} ms, ${told}`);
}
await browser.close();
server.kill("SIGTERM");
await new Promise((ended) => server.once("exit", ended));
rmSync(folder, { recursive: true, force: true });

const sorted = times_ms.toSorted((a, b) => a - b);
const median_ms = sorted[Math.floor((sorted.length - 1) / 2)] ?? Number.NaN;
console.log(`Stop and state after ${median_ms.toFixed(0)} ms (median), ${sorted.at(-1)?.toFixed(0)} ms (longest)`);
process.exitCode = median_ms <= PROMISED_MS ? 0 : 1;
