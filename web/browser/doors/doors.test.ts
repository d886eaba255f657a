/**
 * A webhook of the real program to a receiver that works, is overloaded, or accepts no more, and a door for PLCs, as the page
 * shows them.
 */

import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { expectAccessibleInBoth, launch, NO_GRAPHICS, picture, until, visit } from "../support/harness";
import { Receiver } from "../support/receiver";
import { Server } from "../support/server";

/** A simulated fault that a station at rest does not notice: its events are what is delivered. */
const FAULT = "wavelength_drift";

let folder: string;
let receiver: Receiver;
let server: Server;
let browser: Browser;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), "sheaf-doors-"));
  receiver = await Receiver.start();
  const secret_file = join(folder, "mes.secret");
  writeFileSync(secret_file, `whsec_${Buffer.alloc(32, "secret").toString("base64")}\n`, { mode: 0o600 });
  const config = join(folder, "sheaf.toml");
  writeFileSync(
    config,
    `[[doors.webhook]]
name = "mes"
url = "${receiver.url}"
secret_file = "${secret_file}"
events = ["simulation.*"]
allowed_private = ["127.0.0.1/32"]

[[doors.modbus]]
name = "plc"
listen = "127.0.0.1:0"
`,
  );
  [server, browser] = await Promise.all([Server.start(["--config", config]), launch(NO_GRAPHICS)]);
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
  await receiver?.end();
  rmSync(folder, { recursive: true, force: true });
});

const doorOn = (page: Page) => page.locator('[data-door="mes"]');
const inState = (page: Page, state: string) => page.locator(`[data-door="mes"][data-door-state="${state}"]`);
const sendTest = (page: Page) => doorOn(page).getByRole("button", { name: "Send test message" }).click();
const faultOn = () => server.call("PUT", "/api/v1/simulation/faults", { name: FAULT });
const faultOff = () => server.call("DELETE", `/api/v1/simulation/faults/${FAULT}`);
const newest = () => receiver.messages.at(-1)?.type;

test("a test message and events arrive, and the page shows each attempt", async () => {
  const { page, context, complaints } = await visit(browser, server.url, "#/settings");
  await inState(page, "delivering").waitFor();
  expect(await doorOn(page).textContent()).toContain(receiver.url);
  await doorOn(page).getByText("No attempts since the server was started.").waitFor();

  await sendTest(page);
  await doorOn(page).getByText("test message delivered").waitFor();
  expect(receiver.messages.map(({ type }) => type)).toEqual(["door.test"]);

  await faultOn();
  await until("the event", () => newest() === "simulation.fault_enabled");
  const seq = receiver.messages.at(-1)?.seq ?? 0;
  await until("the count", async () => (await doorOn(page).locator("dd").first().textContent()) === "1 event");
  await doorOn(page).getByText(`event ${seq}, `).waitFor();
  await doorOn(page).getByText("Last attempts (2)").click();
  const attempts = await doorOn(page).locator("[data-attempt=delivered]").allTextContents();
  expect(attempts[0]).toContain(`${seq} · simulated fault on`);
  expect(attempts[1]).toContain("Test message");
  expect(attempts).toHaveLength(2);
  await expectAccessibleInBoth(page);
  await picture(page, "settings-doors");
  expect(complaints).toEqual([]);
  await context.close();
});

test("while the receiver is overloaded the door waits and says why; afterwards nothing is missing", async () => {
  const { page, context, complaints } = await visit(browser, server.url, "#/settings");
  receiver.status = 503;
  await faultOff();
  await inState(page, "waiting").waitFor();
  await doorOn(page).getByText("the receiver answered 503 Service Unavailable").first().waitFor();
  await doorOn(page)
    .getByText(/^Next attempt /)
    .waitFor();
  await sendTest(page);
  const problem = doorOn(page).locator(".problem");
  await problem.waitFor();
  expect(await problem.textContent()).toContain("the test message was not delivered to mes");
  expect(await problem.textContent()).toContain("503 Service Unavailable");
  expect(await problem.textContent()).toContain("check the address and the receiver");
  await expectAccessibleInBoth(page);
  await picture(page, "settings-door-waiting");

  await page.goto(`${server.url}/#/health`);
  await page.locator("[data-tone=caution]", { hasText: "mes: waiting" }).waitFor();
  await page.locator(".events").getByText("door waiting").waitFor();
  await expectAccessibleInBoth(page);
  receiver.status = 204;
  await page.locator(".events").getByText("door delivering again").waitFor();
  await page.locator("[data-tone=calm]", { hasText: "2 doors delivering" }).waitFor();
  expect(newest()).toBe("simulation.fault_disabled");
  expect(complaints).toEqual([]);
  await context.close();
});

test("a receiver that accepts no more events closes the door until a test message is delivered", async () => {
  const { page, context, complaints } = await visit(browser, server.url, "#/health");
  await page.locator("[data-tone=calm]", { hasText: "2 doors delivering" }).waitFor();
  receiver.status = 410;
  await faultOn();
  const card = page.locator("[data-tone=alarm]", { hasText: "mes: closed" });
  await card.getByText("the receiver answered 410 Gone").waitFor();
  await card.getByRole("link", { name: "Settings" }).click();
  await inState(page, "closed").waitFor();
  expect(page.url()).toMatch(/#\/settings\/doors$/);
  await expectAccessibleInBoth(page);
  receiver.status = 204;
  await sendTest(page);
  await inState(page, "delivering").waitFor();
  await until("the event", () => newest() === "simulation.fault_enabled");
  await faultOff();
  expect(complaints).toEqual([]);
  await context.close();
});

test("the door for PLCs offers its registers, and only it does", async () => {
  const { page, context, complaints } = await visit(browser, server.url, "#/settings");
  const offer = page.locator('[data-door="plc"]').getByRole("link", { name: "Registers (CSV)" });
  const [download] = await Promise.all([page.waitForEvent("download"), offer.click()]);
  expect(download.suggestedFilename()).toBe("plc_registers.csv");
  const rows = readFileSync(await download.path(), "utf8").split("\r\n");
  expect(rows[0]).toBe("table,address,words,type,access,name,meaning");
  expect(rows.some((row) => row.includes(",command_seq,"))).toBe(true);
  expect(await doorOn(page).getByRole("link").count()).toBe(0);
  expect(complaints).toEqual([]);
  await context.close();
});
