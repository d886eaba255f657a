/** No page, no dialog and no state of the frame violates WCAG 2.2 A or AA as far as axe can tell; light and dark. */

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { PAGES } from "../../src/state/browser/route";
import { expectAccessibleInBoth, launch, type Visit, visit } from "../support/harness";
import { Server } from "../support/server";

let server: Server;
let browser: Browser;

beforeAll(async () => {
  [server, browser] = await Promise.all([Server.start(), launch()]);
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

/** The page has its code, its first data and the state of the station. */
async function settled(page: Page): Promise<void> {
  await page.locator(".bar", { hasText: "Operational.Initialized" }).waitFor();
  await page.locator("main h1, main h2, main .problem").first().waitFor();
  await page.waitForFunction(() => !document.querySelector("main")?.textContent?.includes("Loading…"));
}

describe("in light and dark", () => {
  let visitor: Visit;

  beforeAll(async () => {
    visitor = await visit(browser, server.url);
  });

  afterAll(async () => {
    await visitor.context.close();
  });

  test.each([...PAGES, "result/00000000-0000-7000-8000-000000000000"])("%s", async (name) => {
    const { page, complaints } = visitor;
    await page.goto(`${server.url}/#/${name}`);
    await settled(page);
    await expectAccessibleInBoth(page);
    expect(complaints).toEqual([]);
  });

  test("the dialog of control, and the fold-out of Operate", async () => {
    const { page, complaints } = visitor;
    await page.goto(`${server.url}/#/operate`);
    await settled(page);
    await page.getByText("Scan and measurement settings").click();
    await page.getByRole("button", { name: "Add a measurement" }).waitFor();
    await expectAccessibleInBoth(page);
    await page.getByRole("button", { name: "No one in control" }).click();
    await page.getByRole("dialog").waitFor();
    await expectAccessibleInBoth(page);
    await page.keyboard.press("Escape");
    await page.getByRole("dialog").waitFor({ state: "detached" });
    expect(complaints).toEqual([]);
  });

  test("stopped, and in error", async () => {
    const { page, complaints } = visitor;
    await page.goto(`${server.url}/#/health`);
    await settled(page);
    await server.call("PUT", "/api/v1/simulation/faults", { name: "stage_unplugged" });
    await page.locator(".banners .problem", { hasText: "Fault" }).waitFor();
    await page.locator("[data-tone=alarm]").waitFor();
    await expectAccessibleInBoth(page);
    await server.call("DELETE", "/api/v1/simulation/faults/stage_unplugged");
    await page.locator(".banners").getByRole("button", { name: "Acknowledge and reset" }).click();
    await page.locator(".bar", { hasText: "Operational.Initialized" }).waitFor();
    await page.keyboard.press("Pause");
    await page.locator(".bar", { hasText: "Halted" }).waitFor();
    await expectAccessibleInBoth(page);
    await page.locator(".banners").getByRole("button", { name: "Reset" }).click();
    await page.locator(".bar", { hasText: "Operational.Initialized" }).waitFor();
    expect(complaints).toEqual([]);
  });
});
