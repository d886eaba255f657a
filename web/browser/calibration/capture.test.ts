/**
 * An uploaded capture: uploaded, calibrated from, a draft, activated, named in the log; results of it,
 * deleted and damaged.
 */

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Schemas } from "../../src/api/client";
import { tarOfFolder } from "../support/archive";
import { expectAccessible, expectAccessibleInBoth, launch, NO_GRAPHICS, picture, visit } from "../support/harness";
import { Server, SHEAF } from "../support/server";

/** A calibration on a busy machine. */
const SOLVED_WITHIN_MS = 200_000;

let server: Server;
let browser: Browser;
let folder = "";

beforeAll(async () => {
  folder = join(mkdtempSync(join(tmpdir(), "sheaf-capture-")), "capture");
  // Small images: this tests the workflow, not the quality of the calibration.
  const size = ["--width-px", "640", "--height-px", "512", "--poses", "6", "--frames", "1", "--scene", "plate"];
  execFileSync(SHEAF, ["twin", "capture", "--quiet", ...size, "--output", folder]);
  [server, browser] = await Promise.all([Server.start(), launch(NO_GRAPHICS)]);
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
  rmSync(join(folder, ".."), { recursive: true, force: true });
});

test("an uploaded capture becomes a draft and is activated only by the user", async () => {
  const { page, context, complaints } = await visit(browser, server.url, "#/calibration");
  const archive = { name: "night shift.tar", mimeType: "application/x-tar", buffer: tarOfFolder(folder) };
  await page.getByLabel("From an uploaded capture").setInputFiles(archive);
  const fresh = page.locator("[data-fresh]");
  await fresh.waitFor({ timeout: SOLVED_WITHIN_MS });
  await expectAccessible(page);
  await picture(page, "calibration-uploaded");
  const id = (await fresh.getAttribute("data-fresh")) ?? "";
  const active = () => server.call<Schemas["ActiveCalibrationDto"]>("GET", "/api/v1/calibrations/active");
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

/** Flips a bit wherever the database holds `text`, as a failing disk would. */
function damage(server: Server, text: string): void {
  const file = join(server.folder, "data/catalogue.sqlite3");
  const bytes = readFileSync(file);
  let n_places = 0;
  // A row that was moved leaves its bytes where it was.
  for (let at = bytes.indexOf(text); at >= 0; at = bytes.indexOf(text, at + 1), n_places += 1) {
    bytes[at] = (bytes[at] ?? 0) ^ 1;
  }
  expect(n_places, text).toBeGreaterThan(0);
  writeFileSync(file, bytes);
}

/** Three results, of which the second is damaged, as are the job of the calibration and an event; answers their ids. */
async function damaged(): Promise<{ scans: string[]; job: string; event: string }> {
  const [capture] = (await server.call<Schemas["ListDto_CaptureDto"]>("GET", "/api/v1/captures")).items;
  const scans: string[] = [];
  for (const name of ["first", "ball-of-tuesday", "last"]) {
    const source = { kind: "capture", capture_id: capture?.id, scan: "plate" };
    scans.push((await server.job("/api/v1/scans", { source, name })).result?.id ?? "");
  }
  for (const holder of ["Monday", "Tuesday"]) {
    await server.call("POST", "/api/v1/station/control", { holder, take_over: true });
  }
  const { items: jobs } = await server.call<Schemas["ListDto_JobDto"]>("GET", "/api/v1/jobs");
  const { items: events } = await server.call<Schemas["EventListDto"]>("GET", "/api/v1/events?limit=200");
  const takeover = '"to":"Tuesday"';
  const event = events.find(({ body }) => JSON.stringify(body).includes(takeover));
  await server.terminate();
  // Opening folds the log into the database.
  await (await server.startAgain()).terminate();
  // Neighbours in the row.
  for (const text of ["ball-of-tuesdaycomplete", "calibrationsucceeded{", takeover]) damage(server, text);
  server = await server.startAgain();
  return { scans, job: jobs.find(({ kind }) => kind === "calibration")?.id ?? "", event: `${event?.seq}` };
}

test("damage is shown with its remedy; deleting asks for confirmation", async () => {
  const { scans, job, event } = await damaged();
  const { page, context, complaints } = await visit(browser, server.url, "#/results");
  const answer = (name: string) => page.getByRole("dialog").getByRole("button", { name, exact: true }).click();
  const row = page.locator(`[data-damaged="${scans[1]}"]`);
  await row.waitFor();
  await page.getByText("A record is damaged and cannot be shown").waitFor();
  for (const name of ["first", "last"]) await page.getByRole("link", { name, exact: true }).waitFor();
  await expectAccessibleInBoth(page);
  await picture(page, "results-damaged");
  await row.getByRole("button", { name: "Delete" }).click();
  await page.getByRole("dialog", { name: "Delete result" }).waitFor();
  await expectAccessibleInBoth(page);
  await answer("Delete permanently");
  await row.waitFor({ state: "detached" });

  await page.getByRole("button", { name: "Delete last" }).click();
  await page.getByRole("dialog", { name: "Delete result" }).waitFor();
  await expectAccessibleInBoth(page);
  await picture(page, "results-delete");
  await answer("Cancel");
  await page.getByRole("dialog").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Delete last" }).click();
  await answer("Delete permanently");
  await page.getByRole("link", { name: "last", exact: true }).waitFor({ state: "detached" });
  const left = await server.call<Schemas["ListDto_ScanDto"]>("GET", "/api/v1/scans");
  expect([left.items.map(({ id }) => id), left.damaged]).toEqual([[scans[0]], undefined]);

  // Others can only be restored.
  for (const [hash, id] of [
    ["#/jobs", job],
    ["#/health", event],
  ]) {
    await page.goto(`${server.url}/${hash}`);
    const named = page.locator(`[data-damaged="${id}"]`);
    await named.waitFor();
    expect(await named.getByRole("button").count()).toBe(0);
    await page.getByText("restore the data folder from a backup").waitFor();
    await expectAccessibleInBoth(page);
  }
  expect(complaints).toEqual([]);
  await context.close();
});
