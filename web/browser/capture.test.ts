/** Calibrating from a recording that somebody brings: uploaded, a draft, activated, named in the log. */

import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Schemas } from "../src/api/client";
import { tarOfFolder } from "./archive";
import { expectAccessible, launch, picture, Server, SHEAF, visit } from "./harness";

/** A calibration on a busy machine. */
const SOLVED_WITHIN_MS = 200_000;

let server: Server;
let browser: Browser;
let folder = "";

beforeAll(async () => {
  folder = join(mkdtempSync(join(tmpdir(), "sheaf-capture-")), "capture");
  // Small pictures: what is shown here is the way of a capture, not how good a calibration gets.
  const size = ["--width-px", "640", "--height-px", "512", "--poses", "6", "--frames", "1", "--scene", "plate"];
  execFileSync(SHEAF, ["twin", "capture", "--quiet", ...size, "--output", folder]);
  [server, browser] = await Promise.all([Server.start(), launch()]);
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
  rmSync(join(folder, ".."), { recursive: true, force: true });
});

test("an uploaded capture becomes a draft, and active only by a person's act", async () => {
  const { page, context, complaints } = await visit(browser, server.url, "#/calibration");
  const archive = { name: "night shift.tar", mimeType: "application/x-tar", buffer: tarOfFolder(folder) };
  await page.getByLabel("From an uploaded capture").setInputFiles(archive);
  const fresh = page.locator("[data-fresh]");
  await fresh.waitFor({ timeout: SOLVED_WITHIN_MS });
  await expectAccessible(page);
  await picture(page, "calibration-uploaded");
  const id = (await fresh.getAttribute("data-fresh")) ?? "";
  const active = () => server.call<Schemas["ActiveDto"]>("GET", "/api/v1/calibrations/active");
  expect((await active()).calibration_id ?? null).toBeNull();
  const made = await server.call<Schemas["CalibrationItemDto"]>("GET", `/api/v1/calibrations/${id}`);
  const capture = await server.call<Schemas["CaptureDto"]>("GET", `/api/v1/captures/${made.capture_id}`);
  expect(capture.name).toBe("night shift.tar");
  const row = page.locator(`tr[data-calibration="${id}"]`);
  await row.getByRole("button", { name: "Activate…" }).click();
  await page.getByLabel("Your name").fill("Zoë");
  await page.locator("dialog").getByRole("button", { name: "Activate", exact: true }).click();
  await page.waitForSelector(`section[data-active="${id}"]`);
  await fresh.waitFor({ state: "detached" });
  expect(await active()).toMatchObject({ calibration_id: id, actor: "Zoë" });
  expect(complaints).toEqual([]);
  await context.close();
});
