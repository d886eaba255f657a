/** One calibration session in two browsers at once: both see the same, acts arrive, and whoever is behind is told so. */

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Schemas } from "../../src/api/client";
import {
  expectAccessible,
  expectAccessibleInBoth,
  launch,
  NO_GRAPHICS,
  picture,
  until,
  visit,
} from "../support/harness";
import { Server } from "../support/server";

/** Time limit for an image of the simulated station on a busy machine. */
const TAKEN_WITHIN_MS = 120_000;

let server: Server;
let browser: Browser;

beforeAll(async () => {
  [server, browser] = await Promise.all([Server.start(), launch(NO_GRAPHICS)]);
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

/** A session with images of the first poses of the virtual operator. */
async function sessionWith(n_poses: number): Promise<string> {
  const { target, projector } = await server.call<Schemas["SessionDefaultsDto"]>(
    "GET",
    "/api/v1/calibration-sessions/defaults",
  );
  const body = { name: "Two at once", target, projector, exposures: null };
  const { id } = await server.call<Schemas["SessionDto"]>("POST", "/api/v1/calibration-sessions", body);
  for (let pose = 0; pose < n_poses; pose++) {
    await server.call("PUT", "/api/v1/simulation/board", { place: "pose", pose });
    await takePose(id);
  }
  return id;
}

/** Captures an image as a third client would. Camera faults caused by a busy machine are acknowledged, as an operator would. */
async function takePose(session_id: string): Promise<void> {
  await until(
    "a picture",
    async () => {
      const holder = { holder: "Script", take_over: true };
      const { id } = await server.call<{ id: string }>("POST", "/api/v1/station/control", holder);
      const headers = { "Sheaf-Control": id };
      const path = `/api/v1/calibration-sessions/${session_id}/poses`;
      const taken = await server.call("POST", path, undefined, headers).then(
        () => true,
        () => false,
      );
      await server.call("DELETE", "/api/v1/station/control", undefined, headers);
      if (!taken) await server.reset();
      return taken;
    },
    TAKEN_WITHIN_MS,
  );
}

const posesOf = (page: Page) =>
  page.locator(".poses .pose").evaluateAll((all) => all.map((pose) => pose.getAttribute("data-pose")));

const sessionAt = (id: string) => server.call<Schemas["SessionDto"]>("GET", `/api/v1/calibration-sessions/${id}`);

/** The images that are drawn, not only listed. */
const drawn = (page: Page) =>
  page
    .locator(".poses .pose img")
    .evaluateAll((all) =>
      all.map((image) => (image instanceof HTMLImageElement && image.complete ? image.currentSrc : "")),
    );

test("both see the same images; one deleted in one browser disappears in the other", async () => {
  const id = await sessionWith(3);
  const [one, other] = await Promise.all(
    [1, 2].map(() => visit(browser, server.url, `#/calibration/${id}?step=camera`)),
  );
  if (!one || !other) throw new Error("two browsers");
  const wanted = (await sessionAt(id)).body.poses.map((pose) => pose.id);
  expect(wanted).toHaveLength(3);
  for (const { page } of [one, other]) {
    await until("all poses", async () => (await posesOf(page)).join() === wanted.join());
    await page.locator(".poses").scrollIntoViewIfNeeded();
    await until("all pictures", async () => (await drawn(page)).every((source) => source !== ""));
  }
  expect(await drawn(other.page)).toEqual(await drawn(one.page));

  await one.page.locator(`[data-pose="${wanted[2]}"]`).getByRole("button", { name: "Delete" }).click();
  const begun = Date.now();
  await until("gone there", async () => (await posesOf(other.page)).join() === wanted.slice(0, 2).join());
  console.log(`deleted in one browser, gone in the other after ${Date.now() - begun} ms`);
  expect(await posesOf(one.page)).toEqual(wanted.slice(0, 2));
  expect([...one.complaints, ...other.complaints]).toEqual([]);
  await Promise.all([one.context.close(), other.context.close()]);
});

test("an outdated browser changes nothing, sees the newest state and the reason", async () => {
  const id = await sessionWith(2);
  const { page, context, complaints } = await visit(browser, server.url, `#/calibration/${id}?step=camera`);
  await until("both poses", async () => (await posesOf(page)).length === 2);
  const [first, second] = (await sessionAt(id)).body.poses.map((pose) => pose.id);
  // From now on this browser gets no events of the session.
  let hear = () => {};
  const deaf = new Promise<void>((resolve) => {
    hear = resolve;
  });
  await page.route(`**/api/v1/calibration-sessions/${id}`, async (route) => {
    await deaf;
    await route.continue();
  });
  await server.call("DELETE", `/api/v1/calibration-sessions/${id}/poses/${first}`);
  const refused = page.waitForResponse((answer) => answer.request().method() === "DELETE");
  await page.locator(`[data-pose="${second}"]`).getByRole("button", { name: "Delete" }).click();
  expect((await refused).status()).toBe(412);
  hear();
  await page.getByText("Changed in another browser").waitFor();
  await until("the newest state", async () => (await posesOf(page)).join() === second);
  // The refused change was not carried out.
  expect((await sessionAt(id)).body.poses.map((pose) => pose.id)).toEqual([second]);
  await page.evaluate(() => document.querySelector(".page")?.scrollTo(0, 0));
  await expectAccessible(page);
  await picture(page, "calibration-behind");
  await page.locator(`[data-pose="${second}"]`).getByRole("button", { name: "Delete" }).click();
  await until("deleted now", async () => (await sessionAt(id)).body.poses.length === 0);
  await page.getByText("Changed in another browser").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Discard…" }).first().click();
  await page.locator("dialog").waitFor();
  await expectAccessibleInBoth(page);
  expect(complaints).toEqual([]);
  await context.close();
});

test(
  "a calibration of a session is verified on the reference sphere, and the outcome stays visible",
  async () => {
    const id = await sessionWith(8);
    await server.call("PUT", "/api/v1/simulation/board", { place: "stage" });
    for (const position_mm of [-15, 0, 15]) {
      const holder = { holder: "Script", take_over: true };
      const { id: lease } = await server.call<{ id: string }>("POST", "/api/v1/station/control", holder);
      const headers = { "Sheaf-Control": lease };
      await server.call("POST", `/api/v1/calibration-sessions/${id}/stage-views`, { position_mm }, headers);
      // The page is to find the station free.
      await server.call("DELETE", "/api/v1/station/control", undefined, headers);
    }
    await server.call("PUT", "/api/v1/simulation/board", { place: "away" });
    await server.job(`/api/v1/calibration-sessions/${id}/solve`, {});
    const { page, context, complaints } = await visit(browser, server.url, `#/calibration/${id}`);
    await page.waitForSelector('.wizard[data-step="verify"]');
    await page.getByRole("button", { name: "Scan and compare" }).click();
    const outcome = page.locator(".outcome").first();
    await outcome.waitFor();
    expect(await outcome.getAttribute("data-verdict")).toBe("ok");
    expect(await outcome.textContent()).toContain("18.9000 mm ± 0.1000 mm");
    await expectAccessibleInBoth(page);
    await page.waitForSelector('.wizard[data-step="verify"]');
    await picture(page, "calibration-verified");
    expect(complaints).toEqual([]);
    await context.close();
  },
  TAKEN_WITHIN_MS + 180_000,
);
