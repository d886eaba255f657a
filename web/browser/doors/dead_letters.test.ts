/** Deliveries that a door has set aside, which the real program has only after minutes and a day: resent and deleted. */

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Delivery, Door } from "../../src/state/records/doors";
import { FakeStation } from "../support/fake_station";
import { englishIn } from "../support/german";
import { expectAccessibleInBoth, launch, NO_GRAPHICS, picture, until, visit } from "../support/harness";

const REASON = "the receiver answered 422 Unprocessable Entity: no such serial number";

const DOOR: Door = {
  name: "mes",
  kind: "webhook",
  target: "https://mes.example.com/hook",
  state: "delivering",
  n_behind: 0,
  n_delivered: 4321,
  n_waiting: 1,
  n_dead: 2,
  delivered_seq: 4711,
  delivered_at_ms: 1_795_000_000_000,
  attempts: [
    { at_ms: 1_795_000_000_000, seq: 4711, kind: "inspection.finished" },
    { at_ms: 1_794_999_990_000, seq: 4708, kind: "inspection.finished", reason: REASON },
  ],
};

function delivery(seq: number, part: Pick<Delivery, "state" | "n_attempts" | "next_at_ms">): Delivery {
  const event = { kind: "door.recovered", body: {}, seq, subject: "line-2", at_ms: 1_794_900_000_000 } as const;
  return { event, reason: REASON, ...part };
}

let station: FakeStation;
let browser: Browser;

beforeAll(async () => {
  [station, browser] = await Promise.all([FakeStation.start(), launch(NO_GRAPHICS)]);
});

afterAll(async () => {
  await browser?.close();
  await station?.end();
});

/** Answers for the doors in place of the server; what the page does changes the list as there. */
async function withDeliveries(page: Page): Promise<{ asked: string[] }> {
  const asked: string[] = [];
  let deliveries = [
    delivery(4500, { state: "dead", n_attempts: 8 }),
    delivery(4501, { state: "dead", n_attempts: 8 }),
    delivery(4708, { state: "waiting", n_attempts: 3, next_at_ms: Date.now() + 1_000_000 }),
  ];
  const count = (state: string) => deliveries.filter((one) => one.state === state).length;
  await page.route("**/api/v1/doors", (route) => {
    const door = { ...DOOR, n_waiting: count("waiting"), n_dead: count("dead") };
    return route.fulfill({ json: { items: [door] } });
  });
  await page.route("**/api/v1/doors/mes/**", (route) => {
    const method = route.request().method();
    const path = new URL(route.request().url()).pathname;
    if (method === "GET") return route.fulfill({ json: { items: deliveries } });
    asked.push(`${method} ${path}`);
    const seq = Number(/\d+(?=\/resend$|$)/.exec(path)?.[0] ?? Number.NaN);
    deliveries = deliveries.filter(({ event, state }) => event.seq !== seq && (seq || state !== "dead"));
    return method === "DELETE" ? route.fulfill({ status: 204 }) : route.fulfill({ json: { seqs: [] } });
  });
  return { asked };
}

const rows = (page: Page) =>
  page.locator("[data-delivery]").evaluateAll((all) => all.map((row) => row.getAttribute("data-delivery")));

test("deliveries set aside are listed, resent and, after a question, deleted", async () => {
  const { page, context, complaints } = await visit(browser, station.url);
  const { asked } = await withDeliveries(page);
  await page.goto(`${station.url}/#/settings`);
  await page.getByText("Deliveries set aside (3)").click();
  await until("all of them", async () => (await rows(page)).join() === "4500,4501,4708");
  const cells = await page.locator('[data-delivery="4708"] td').allTextContents();
  expect(cells.slice(1, 5)).toEqual(["to be retried", "3", "in 16 minutes", REASON]);
  await expectAccessibleInBoth(page);
  await picture(page, "settings-dead-letters");

  await page.getByRole("button", { name: "Resend (event 4708)" }).click();
  await until("resent", async () => (await rows(page)).join() === "4500,4501");
  await page.getByRole("button", { name: "Delete (event 4500)" }).click();
  await page.getByRole("dialog").waitFor();
  await expectAccessibleInBoth(page);
  await page.getByRole("dialog").getByRole("button", { name: "Cancel" }).click();
  await page.getByRole("dialog").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Delete (event 4500)" }).click();
  await page.getByRole("button", { name: "Delete permanently" }).click();
  await page.getByRole("dialog").waitFor({ state: "detached" });
  await until("deleted", async () => (await rows(page)).join() === "4501");
  await page.getByRole("button", { name: "Resend dead letters (1)" }).click();
  await page.getByText("Deliveries set aside").waitFor({ state: "detached" });
  expect(await page.getByRole("button", { name: "Resend dead letters" }).count()).toBe(0);
  expect(asked).toEqual([
    "POST /api/v1/doors/mes/deliveries/4708/resend",
    "DELETE /api/v1/doors/mes/deliveries/4500",
    "POST /api/v1/doors/mes/resend-dead",
  ]);
  expect(complaints).toEqual([]);
  await context.close();
});

test("doors fit a phone, and are German for Germans", async () => {
  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, locale: "de-DE" };
  const { page, context, complaints } = await visit(browser, station.url, "", phone);
  const narrow = () => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
  await withDeliveries(page);
  await page.goto(`${station.url}/#/settings`);
  await page.getByText("Letzte Versuche (2)").click();
  await page.getByText("Zurückgestellte Zustellungen (3)").click();
  await page.locator("[data-delivery]").first().waitFor();
  expect([await narrow(), await englishIn(page, ".doors")]).toEqual([true, []]);
  expect(complaints).toEqual([]);
  await context.close();
});

test("without doors the page says how one is configured", async () => {
  const { page, context, complaints } = await visit(browser, station.url, "#/settings");
  await page.getByText("No door is configured.").waitFor();
  expect(await page.locator(".doors pre").textContent()).toContain("[[doors.webhook]]");
  await expectAccessibleInBoth(page);
  expect(complaints).toEqual([]);
  await context.close();
});
