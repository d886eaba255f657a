/**
 * A measurement, not a test: how the page's heap grows while Live shows 30 frames per second.
 *
 *   LIVE_MEMORY_MINUTES=30 npx vitest run --config vitest.browser.config.ts browser/measure/live_memory
 *
 * Starts the program (SHEAF_BIN, with its page) with its simulated station, calibrates
 * it, opens Live and reads the heap after a garbage collection every 20 s. Prints each reading and the slope of a
 * straight line through those after the warm-up, MiB/h.
 */

import { expect, test } from "vitest";
import { launch, NO_GRAPHICS } from "../support/harness";
import { Server } from "../support/server";

/** Duration of the measurement; without it the test is skipped. */
const MINUTES = Number(process.env.LIVE_MEMORY_MINUTES ?? 0);
const EVERY_MS = 20_000;

/** Until code is compiled, caches are full and all buffers have their size. */
const WARM_UP_MS = 60_000;

const MIB = 1024 * 1024;

interface Reading {
  at_ms: number;
  heap_mib: number;
  outside_mib: number;
}

/** Slope of the straight line through readings, per hour. */
function slopePerHour(readings: readonly Reading[], figure: (reading: Reading) => number): number {
  const n = readings.length;
  const mean_t = readings.reduce((sum, { at_ms }) => sum + at_ms, 0) / n;
  const mean = readings.reduce((sum, reading) => sum + figure(reading), 0) / n;
  let [tt, tf] = [0, 0];
  for (const reading of readings) {
    tt += (reading.at_ms - mean_t) ** 2;
    tf += (reading.at_ms - mean_t) * (figure(reading) - mean);
  }
  return (3_600_000 * tf) / tt;
}

/** The promise: less than this after the warm-up, MiB/h. */
const LARGEST_SLOPE = 1;

test.runIf(MINUTES > 0)("the heap does not grow while Live runs", measure, 60_000 * MINUTES + 600_000);

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
    const session = await context.newCDPSession(page);
    await session.send("HeapProfiler.enable");
    const readings: Reading[] = [];
    const begun = Date.now();
    while (Date.now() - begun < 60_000 * MINUTES) {
      await page.waitForTimeout(EVERY_MS);
      // Before the collection, which stops the page for some frames.
      const rate = await page.textContent('.frame-facts [data-fact="rate"] dd');
      const frame = await page.textContent('.frame-facts [data-fact="frame"] dd');
      await session.send("HeapProfiler.collectGarbage");
      const usage: { usedSize: number; backingStorageSize?: number } = await session.send("Runtime.getHeapUsage");
      const reading = {
        at_ms: Date.now() - begun,
        heap_mib: usage.usedSize / MIB,
        outside_mib: (usage.backingStorageSize ?? 0) / MIB,
      };
      readings.push(reading);
      const told = `heap ${reading.heap_mib.toFixed(3)} MiB, buffers ${reading.outside_mib.toFixed(3)} MiB`;
      console.log(`${(reading.at_ms / 1000).toFixed(0)} s: ${told}, ${rate}, frame ${frame}`);
    }
    const warm = readings.filter(({ at_ms }) => at_ms > WARM_UP_MS);
    const slopes = [slopePerHour(warm, (one) => one.heap_mib), slopePerHour(warm, (one) => one.outside_mib)];
    console.log(
      `slope over ${warm.length} readings: heap ${slopes[0]?.toFixed(3)}, buffers ${slopes[1]?.toFixed(3)} MiB/h`,
    );
    expect(slopes[0]).toBeLessThan(LARGEST_SLOPE);
  } finally {
    await browser.close();
    await server.stop();
  }
}
