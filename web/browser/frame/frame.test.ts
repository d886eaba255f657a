/** The frame around all pages: Stop, the age of the link, who commands, two languages. What pages show is theirs. */

import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from "vitest";
import type { Schemas, Station } from "../../src/api/client";
import { PAGES } from "../../src/state/browser/route";
import { de } from "../../src/text/de";
import { en } from "../../src/text/en";
import { AT_WORK, ENDED, englishIn } from "../support/german";
import {
  closeTab,
  expectAccessible,
  launch,
  NO_GRAPHICS,
  picture,
  until,
  type Visit,
  visit,
} from "../support/harness";
import { Server } from "../support/server";
import { StagedJob } from "../support/staged_job";

let server: Server;
let browser: Browser;
const open: Visit[] = [];

beforeAll(async () => {
  [server, browser] = await Promise.all([Server.start(), launch(NO_GRAPHICS)]);
});

afterEach(async () => {
  for (const { page, context } of open.splice(0)) {
    if (!page.isClosed()) await closeTab(page);
    await context.close();
  }
});

// A failed test may have left the station stopped; that must not block the others.
beforeEach(async () => {
  if ((await state()) !== "Operational.Initialized") await server.reset();
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

async function enter(hash = "", options = {}): Promise<Visit> {
  const visitor = await visit(browser, server.url, hash, options);
  open.push(visitor);
  await visitor.page.locator(".bar", { hasText: "Operational.Initialized" }).waitFor();
  return visitor;
}

async function state(): Promise<string> {
  return (await server.call<Station>("GET", "/api/v1/station")).state;
}

async function stopBy(page: Page, way: number): Promise<void> {
  if (way === 0) await page.getByRole("button", { name: "Stop", exact: true }).click();
  if (way === 1) await page.keyboard.press("Control+.");
  if (way === 2) await page.keyboard.press("Pause");
  if (way === 3) {
    await page.getByRole("button", { name: "Stop", exact: true }).focus();
    await page.keyboard.press("Enter");
  }
}

test("Stop reaches the server from every page, by pointer and by keys, and a reset leads back", async () => {
  const { page, complaints } = await enter();
  for (const [at, name] of [...PAGES, "result/none"].entries()) {
    await page.goto(`${server.url}/#/${name}`);
    await page.locator("main h1, main .problem").first().waitFor();
    await stopBy(page, at % 4);
    await until(`Halted from ${name}`, async () => (await state()) === "Halted");
    await page.locator(".banners").getByRole("button", { name: "Reset" }).click();
    await until("reset", async () => (await state()) === "Operational.Initialized");
  }
  expect(complaints).toEqual([]);
});

test("Stop is on the screen at the width of a phone, and a finger on it is enough", async () => {
  const { page, complaints } = await enter("", { viewport: { width: 390, height: 844 }, hasTouch: true });
  const stop = page.getByRole("button", { name: "Stop", exact: true });
  const box = await stop.boundingBox();
  expect(box).not.toBeNull();
  expect((box?.x ?? 0) + (box?.width ?? 0)).toBeLessThanOrEqual(390);
  expect(box?.height).toBeGreaterThanOrEqual(56);
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
  // Only pointer down: a finger that slides off the button counts, too.
  await stop.dispatchEvent("pointerdown");
  await until("Halted", async () => (await state()) === "Halted");
  await picture(page, "phone-stopped");
  await page.locator(".banners").getByRole("button", { name: "Reset" }).click();
  await until("reset", async () => (await state()) === "Operational.Initialized");
  expect(complaints).toEqual([]);
});

test("Stop works while a dialog is open, by pointer and by keys", async () => {
  const { page, complaints } = await enter("#/health");
  await page.getByRole("button", { name: "No one in control" }).click();
  const dialog = page.getByRole("dialog");
  await dialog.waitFor();
  const box = await page.locator(".bar .stop").boundingBox();
  if (!box) throw new Error("no Stop");
  await picture(page, "stop-and-dialog");
  for (const stop of [
    () => page.mouse.click(box.x + box.width / 2, box.y + box.height / 2),
    () => page.keyboard.press("Pause"),
  ]) {
    await stop();
    await until("Halted", async () => (await state()) === "Halted");
    expect(await dialog.isVisible()).toBe(true);
    await server.reset();
    await until("reset", async () => (await state()) === "Operational.Initialized");
  }
  expect(complaints).toEqual([]);
});

test("the data of a dead server is called stale, and the page reconnects automatically", async () => {
  const { page, complaints } = await enter("#/health");
  await page.evaluate(() => Object.assign(window, { kept: "this page was not loaded again" }));
  await server.kill();
  await page.locator(".frame.stale").waitFor();
  await page.getByText("No connection to the server.").waitFor();
  expect(await page.getByRole("status").filter({ hasText: "stale" }).isVisible()).toBe(true);
  expect(await page.title()).toMatch(/^no connection/);
  await picture(page, "stale");
  // Stop cannot reach a dead server: the page reports it at once and keeps retrying.
  await page.keyboard.press("Pause");
  await page.getByText("Use the emergency stop of the machine").waitFor();
  server = await server.startAgain();
  await page.locator(".frame:not(.stale)").waitFor();
  await page.locator(".link", { hasText: "live" }).waitFor();
  await page.locator(".bar", { hasText: "Halted" }).waitFor();
  await page.getByText("Use the emergency stop of the machine").waitFor({ state: "detached" });
  await page.locator(".banners").getByRole("button", { name: "Reset" }).click();
  await page.locator(".bar", { hasText: "Operational.Initialized" }).waitFor();
  expect(await page.evaluate(() => (window as { kept?: string }).kept)).toBe("this page was not loaded again");
  expect(complaints).toEqual([]);
});

async function takeControl(page: Page, button: RegExp, name: string, act: string): Promise<void> {
  await page.getByRole("button", { name: button }).click();
  const dialog = page.getByRole("dialog");
  await dialog.getByLabel("Your name, as others see it").fill(name);
  await dialog.getByRole("button", { name: act, exact: true }).click();
  await dialog.waitFor({ state: "detached" });
}

test("two browsers see who is in control; taking over is explicit and reported to the former holder", async () => {
  const [anna, ben] = [await enter(), await enter()];
  await takeControl(anna.page, /No one in control/, "Anna", "Take control");
  await anna.page.getByRole("button", { name: "You are in control" }).waitFor();
  await ben.page.getByRole("button", { name: "Anna is in control – Take over" }).waitFor();
  await picture(ben.page, "control-taken");
  await takeControl(ben.page, /Anna is in control/, "Ben", "Take over");
  await ben.page.getByRole("button", { name: "You are in control" }).waitFor();
  await anna.page.getByText("Ben took control of the station.").waitFor();
  await anna.page.getByRole("button", { name: "Ben is in control – Take over" }).waitFor();

  // Stop needs no control, and both see the same state.
  await anna.page.getByRole("button", { name: "Stop", exact: true }).click();
  for (const { page } of [anna, ben]) await page.locator(".bar", { hasText: "stopped" }).waitFor();
  await ben.page.locator(".banners").getByRole("button", { name: "Reset" }).click();
  for (const { page } of [anna, ben]) await page.locator(".bar", { hasText: "Not ready to scan" }).waitFor();

  // A page that is closed releases control.
  await closeTab(ben.page);
  await anna.page.getByRole("button", { name: "No one in control" }).waitFor();
  expect([...anna.complaints, ...ben.complaints]).toEqual([]);
});

/** Texts of a catalogue that are plain strings, at any depth. */
function strings(words: unknown): string[] {
  if (typeof words === "string") return [words];
  return typeof words === "object" && words !== null ? Object.values(words).flatMap(strings) : [];
}

test("in German no English is left in the frame", async () => {
  const { page, complaints } = await enter("#/settings");
  await page.getByLabel("Language", { exact: true }).selectOption("de");
  await page.getByRole("heading", { name: "Einstellungen" }).waitFor();
  expect(await page.evaluate(() => document.documentElement.lang)).toBe("de");
  const shown = await page
    .locator(".bar, .rail")
    .evaluateAll((parts) =>
      parts.flatMap((part) =>
        [...part.querySelectorAll("*")].flatMap((element) => [
          element.children.length === 0 ? (element.textContent ?? "").trim() : "",
          element.getAttribute("aria-label") ?? "",
        ]),
      ),
    );
  const german = new Set(strings([de.frame, de.pages, de.common]));
  const english = strings([en.frame, en.pages, en.common]).filter((word) => !german.has(word));
  expect(shown.filter((word) => english.includes(word))).toEqual([]);
  for (const page of PAGES) expect(shown).toContain(de.pages[page]);
  expect(shown).toContain(de.frame.stop);
  await picture(page, "settings-german");
  // The choice is remembered.
  await page.reload();
  await page.getByRole("heading", { name: "Einstellungen" }).waitFor();
  expect(complaints).toEqual([]);
});

test("in German no English is left where a job is shown, at every step and after every end", async () => {
  const begun = { name: "Nachtschicht" };
  const session = await server.call<Schemas["SessionDto"]>("POST", "/api/v1/calibration-sessions", begun);
  const { page, complaints } = await enter("", { locale: "de-DE" });
  const staged = await StagedJob.before(page, AT_WORK, ENDED);
  await page.route(`**/api/v1/calibration-sessions/${session.id}`, async (route) => {
    const response = await route.fetch();
    const told = (await response.json()) as Schemas["SessionDto"];
    told.body.job_id = AT_WORK.id;
    await route.fulfill({ response, json: told });
  });
  await page.goto(`${server.url}/#/jobs`);
  await page.reload();
  for (const [phase, doing] of Object.entries(de.jobs.phases)) {
    staged.tell({
      step: { phase: phase as Schemas["PhaseDto"], number: 3, total: 12 },
      message: `${phase} of the board`,
    });
    const told = de.jobs.counted(doing, 3, 12);
    await page.locator(".open-job", { hasText: told }).waitFor();
    await page.locator(".bar .state", { hasText: told }).waitFor();
    expect(await englishIn(page, ".bar, .rail, main"), phase).toEqual([]);
  }
  const ended = page.getByRole("region", { name: de.jobs.history });
  const { cancelled, interrupted } = de.jobs.ended;
  for (const words of [...Object.values(de.jobs.made), cancelled, interrupted, de.problems["device-fault"]]) {
    await ended
      .getByText(words ?? "no words")
      .first()
      .waitFor();
  }
  await picture(page, "jobs-german");
  await expectAccessible(page);
  staged.tell({ step: AT_WORK.step ?? null, message: AT_WORK.message });
  const doing = de.jobs.counted(de.jobs.phases.exposing_board ?? "", 3, 12);
  for (const hash of ["#/calibration", `#/calibration/${session.id}?step=stage`, "#/live"]) {
    await page.evaluate((hash) => location.assign(hash), hash);
    await page.locator("main", { hasText: doing }).waitFor();
    expect(await englishIn(page, ".bar, .rail, main"), hash).toEqual([]);
    await expectAccessible(page);
  }
  await picture(page, "live-german");
  expect(complaints).toEqual([]);
});

/** Waits until an element has the focus; pages set it when they are drawn. */
async function focused(page: Page, id: string): Promise<void> {
  await until(
    `focus on ${id}`,
    async () => (await page.evaluate(() => document.activeElement?.id)) === id,
    10_000,
  );
}

test("keys lead to pages, to their list, and past the frame", async () => {
  const { page, complaints } = await enter("#/health");
  await page.getByRole("heading", { name: "Health" }).waitFor();
  await page.keyboard.press("g");
  await page.keyboard.press("j");
  await page.getByRole("heading", { name: "Jobs", level: 1 }).waitFor();
  await page.keyboard.press("Alt+5");
  await page.getByRole("heading", { name: "Results", level: 1 }).waitFor();
  await page.keyboard.press("?");
  await page.getByRole("heading", { name: "Keyboard shortcuts" }).waitFor();
  await focused(page, "help-shortcuts");
  await page.keyboard.press("Alt+1");
  await page.getByLabel("Serial number of the part").waitFor();
  await focused(page, "serial");
  expect(await page.title()).toMatch(/Operate · Sheaf$/);

  // The first stop of Tab leads past bar and rail.
  await page.goto(`${server.url}/#/help`);
  await page.reload();
  await page.getByRole("heading", { name: "Help", level: 1 }).waitFor();
  // From the top of the document: where a browser begins after loading differs with how fast the page was there.
  await page.evaluate(() => {
    document.body.tabIndex = -1;
    document.body.focus();
    document.body.removeAttribute("tabindex");
  });
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await focused(page, "page");
  expect(complaints).toEqual([]);
});

test("a simulated fault is switched on in the settings and shown in the frame and in Health", async () => {
  const { page, complaints } = await enter("#/settings");
  const row = page.getByRole("listitem").filter({ hasText: "Camera unplugged" });
  await row.getByRole("button", { name: "Switch on" }).click();
  await page.locator(".banners .problem", { hasText: "Fault" }).first().waitFor();
  await page.keyboard.press("Alt+7");
  await page.locator("[data-tone=alarm]", { hasText: "Camera" }).waitFor();
  await picture(page, "health-fault");
  await page.keyboard.press("Alt+8");
  await row.getByRole("button", { name: "Switch off" }).click();
  await row.getByRole("button", { name: "Switch on" }).waitFor();
  await page.locator(".banners").getByRole("button", { name: "Acknowledge and reset" }).click();
  await until("reset", async () => (await state()) === "Operational.Initialized");
  await page.locator(".banners .problem").waitFor({ state: "detached" });
  expect(complaints).toEqual([]);
});
