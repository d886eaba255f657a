/**
 * The journey of a new user who reads no documentation: calibrate, scan the sphere, see its radius, take the points home.
 * Against visible names and roles only.
 */

import { readFileSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Schemas, Station } from "../../src/api/client";
import { expectAccessible, launch, picture, until, visit } from "../support/harness";
import { Server } from "../support/server";

/** A job of the simulated station on a busy machine, ms. */
const JOB_MS = 240_000;

/** The whole of it on a machine that does other things as well, ms. */
const JOURNEY_MS = 600_000;

/** Radius of the sphere on the simulated stage, mm: what the twin was built with. */
const SPHERE_MM = 18.9;

let server: Server;
let browser: Browser;

beforeAll(async () => {
  [server, browser] = await Promise.all([Server.start(), launch()]);
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

async function station(): Promise<Station> {
  return await server.call<Station>("GET", "/api/v1/station");
}

/** The newest record of a list. */
async function newest<T>(path: string): Promise<T> {
  const [item] = (await server.call<{ items: T[] }>("GET", `${path}?limit=1`)).items;
  if (item === undefined) throw new Error(`${path} is empty`);
  return item;
}

async function rail(page: Page, name: string): Promise<void> {
  await page.getByRole("navigation", { name: "Pages" }).getByRole("link", { name, exact: true }).click();
}

interface Ply {
  n_points: number;
  /** Bytes of a point, by the header. */
  point_bytes: number;
  /** Bytes after the header. */
  body_bytes: number;
}

const PLY_BYTES: Record<string, number> = {
  char: 1,
  uchar: 1,
  int8: 1,
  uint8: 1,
  short: 2,
  ushort: 2,
  int16: 2,
  uint16: 2,
  int: 4,
  uint: 4,
  int32: 4,
  uint32: 4,
  float: 4,
  float32: 4,
  double: 8,
  float64: 8,
};

function readPly(file: Buffer): Ply {
  const end = "end_header\n";
  const header_bytes = file.indexOf(end) + end.length;
  const lines = file.subarray(0, header_bytes).toString("latin1").split("\n");
  expect(lines[0]).toBe("ply");
  expect(lines[1]).toBe("format binary_little_endian 1.0");
  const n_points = Number(/^element vertex (\d+)$/m.exec(lines.join("\n"))?.[1]);
  const properties = lines.flatMap((line) => /^property (\w+) \w+$/.exec(line)?.[1] ?? []);
  const point_bytes = properties.reduce((sum, type) => sum + (PLY_BYTES[type] ?? Number.NaN), 0);
  return { n_points, point_bytes, body_bytes: file.length - header_bytes };
}

test(
  "a new user calibrates, scans the sphere, reads its radius and downloads the points",
  async () => {
    const { page, context, complaints } = await visit(browser, server.url);

    // Operate states what is missing and links to it.
    await page.getByText("The station is not calibrated.").waitFor();
    await picture(page, "operate-first");
    await page.getByRole("link", { name: "Calibrate", exact: true }).click();
    await page.getByRole("heading", { name: "Calibration", level: 1 }).waitFor();
    await page.getByRole("button", { name: "Calibrate now" }).click();
    await page.getByRole("progressbar").first().waitFor();
    await picture(page, "calibration-running");
    await page.locator(".fresh, .problem").first().waitFor({ timeout: JOB_MS });
    expect(await page.locator(".problem").allTextContents()).toEqual([]);
    await page.getByRole("button", { name: "Activate…" }).first().click();
    await page.getByRole("dialog").getByRole("button", { name: "Activate", exact: true }).click();
    await page.getByRole("dialog").waitFor({ state: "detached" });
    await page.locator(".bar", { hasText: "Operational.Ready" }).waitFor();
    await picture(page, "calibration");

    // Live: the laser shines, frames arrive, and it all ends with the live view.
    await rail(page, "Live");
    const before = (await station()).frames.arrived;
    await page.getByRole("button", { name: "Start live view" }).first().click();
    await page.locator(".bar", { hasText: "live view" }).waitFor();
    await page.locator(".bar .lit", { hasText: "ON" }).waitFor();
    await until("frames", async () => (await station()).frames.arrived > before + 5);
    await page.getByText("No line of this frame has a known order").waitFor({ state: "hidden" });
    await picture(page, "live");
    await page.getByRole("button", { name: "End live view" }).first().click();
    await page.locator(".bar", { hasText: "Operational.Ready" }).waitFor();

    // Scan: what will happen, then the cloud that grows.
    await rail(page, "Scan");
    // Fewer rows than in practice, to keep the test short.
    await page.getByLabel("Step", { exact: true }).fill("1");
    await page.getByLabel("Name or serial number").fill("First sphere");
    await page.locator("[data-plan=there]", { hasText: "41, one every" }).waitFor();
    await picture(page, "scan-plan");
    await page.getByRole("button", { name: "Start scan" }).click();
    await page.getByText("No frame was lost.").waitFor();
    await until("points on the screen", async () => {
      const shown = await page.locator("[data-points]").first().getAttribute("data-points");
      return Number(shown) > 1000;
    });
    await picture(page, "scan-running");
    await page.getByText("Scan done").waitFor({ timeout: JOB_MS });
    await page.getByRole("link", { name: "Show the result" }).click();

    // Result: radius and RMSE.
    await page.getByRole("heading", { name: "Measurements" }).waitFor();
    await page.getByRole("button", { name: "Measure", exact: true }).click();
    const row = page.locator("tr[data-tool=sphere]");
    await row.waitFor({ timeout: JOB_MS });
    const told = await row.textContent();
    const radius_mm = Number(/(\d+\.\d+) mm/.exec((await row.locator("td strong").textContent()) ?? "")?.[1]);
    // Rows 1 mm apart see fewer places than the accuracy tests do; a wrong scale or a wrong order is millimetres off.
    expect(Math.abs(radius_mm - SPHERE_MM)).toBeLessThan(0.05);
    const scan = await newest<Schemas["ScanDto"]>("/api/v1/scans");
    const measured = await newest<Schemas["MeasurementDto"]>(`/api/v1/scans/${scan.id}/measurements`);
    const { value, errors } = measured.result as { value: number; errors: { rmse_mm: number } };
    expect(told).toContain(`${value.toFixed(4)} mm`);
    expect(told).toContain(`${(1000 * errors.rmse_mm).toFixed(1)} µm`);
    await picture(page, "result");

    // The points, as a file whose every byte is spoken for.
    const [download] = await Promise.all([
      page.waitForEvent("download"),
      page.getByRole("region", { name: "Downloads" }).getByRole("link", { name: "PLY" }).first().click(),
    ]);
    const ply = readPly(readFileSync(await download.path()));
    const { n_points } = scan.report as { n_points: number };
    expect(ply.n_points).toBe(n_points);
    expect(ply.body_bytes).toBe(n_points * ply.point_bytes);

    await rail(page, "Jobs");
    await page.getByText("First sphere").first().waitFor();
    await picture(page, "jobs");
    await rail(page, "Results");
    await page.getByRole("link", { name: "First sphere" }).waitFor();
    await page.locator(".trend canvas").waitFor();
    await picture(page, "results");
    await expectAccessible(page);
    await rail(page, "Health");
    await page.getByText("the orders agree").waitFor();
    await picture(page, "health");
    await expectAccessible(page);
    expect(complaints).toEqual([]);
    await context.close();
  },
  JOURNEY_MS,
);
