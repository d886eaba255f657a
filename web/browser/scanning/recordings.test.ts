/** A live view is recorded, listed and deleted by a person; the file is the one that the server keeps. */

import { readFileSync } from "node:fs";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import {
  calibrated,
  expectAccessibleInBoth,
  launch,
  NO_GRAPHICS,
  picture,
  until,
  type Visit,
  visit,
} from "../support/harness";
import type { Server } from "../support/server";

interface Recordings {
  items: { id: string; state: string; n_frames: number; size_bytes: number }[];
}

/** How an MCAP file begins and ends. */
const MAGIC = [0x89, ...new TextEncoder().encode("MCAP0\r\n")];

let server: Server;
let browser: Browser;
let seen: Visit;

beforeAll(async () => {
  server = await calibrated();
  browser = await launch(NO_GRAPHICS);
  seen = await visit(browser, server.url, "#/live");
}, 300_000);

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

const listed = async () => (await server.call<Recordings>("GET", "/api/v1/recordings")).items;

test("a person records a live view, downloads it and deletes it", async () => {
  const { page } = seen;
  const card = page.locator("[data-recordings]");
  const record = card.getByRole("button", { name: "Record", exact: true });
  await expect.poll(() => record.isDisabled()).toBe(true);
  await card.getByText("Nothing recorded yet.").waitFor();
  await page.locator(".controls .card").first().getByRole("button", { name: "Start live view" }).click();
  await until("recording is possible", async () => await record.isEnabled());
  await record.click();
  await until("frames are recorded", async () => ((await listed())[0]?.n_frames ?? 0) >= 5);
  await until("they are shown", async () => /[1-9]\d* frames/.test((await card.textContent()) ?? ""));
  await picture(page, "live-recording");
  await card.getByRole("button", { name: "Stop recording" }).click();
  await until("it is finished", async () => (await listed())[0]?.state === "complete");
  const [recording] = await listed();
  if (!recording) throw new Error("no recording");
  const row = card.locator(`li[data-recording="${recording.id}"]`);
  await row.waitFor();
  await picture(page, "live-recorded");
  await expectAccessibleInBoth(page);

  const [download] = await Promise.all([
    page.waitForEvent("download"),
    row.getByRole("link", { name: "Download" }).click(),
  ]);
  expect(download.suggestedFilename()).toBe("live view.mcap");
  const bytes = readFileSync(await download.path());
  expect(bytes.length).toBe(recording.size_bytes);
  expect([...bytes.subarray(0, 8)]).toEqual(MAGIC);
  expect([...bytes.subarray(-8)]).toEqual(MAGIC);

  await row.getByRole("button", { name: "Delete" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Delete recording" }).click();
  await until("it is gone", async () => (await listed()).length === 0 && (await row.count()) === 0);
});
