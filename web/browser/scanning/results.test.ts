/** The filter of the results: in the address, and applied by the server. */

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { calibrated, launch, until, visit } from "../support/harness";
import type { Server } from "../support/server";

/** Tests that calibrate or scan, on a busy machine. */
const STATION_MS = 300_000;

/** The first one is within its tolerance, the second is not judged. */
const PLATES = ["PLATE-1", "PLATE-2"];

let server: Server;
let browser: Browser;

beforeAll(async () => {
  [server, browser] = await Promise.all([calibrated(), launch()]);
  for (const name of PLATES) {
    const scan = { name, source: { kind: "station" }, from_mm: -2, to_mm: 2, step_mm: 1 };
    const { result } = await server.job("/api/v1/scans", scan);
    if (name !== PLATES[0]) continue;
    await server.call("POST", `/api/v1/scans/${result?.id}/measurements`, { tool: "flatness", tolerance_mm: 5 });
  }
}, 600_000);

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

const names = (page: Page) => page.locator("tr[data-outcome] .name").allTextContents();
const listed = (page: Page, expected: readonly string[]) =>
  until(`only ${expected}`, async () => (await names(page)).join() === expected.join());
/** What the page asks the server for, the next time it lists scans with this field. */
const asked = (page: Page, field: string) =>
  page.waitForRequest((request) => {
    const { pathname, searchParams } = new URL(request.url());
    return pathname === "/api/v1/scans" && searchParams.has(field);
  });

test(
  "results are filtered by name, verdict and day, in the address and by the server",
  async () => {
    const { page, context, complaints } = await visit(browser, server.url, "#/results");
    await listed(page, ["PLATE-2", "PLATE-1"]);

    const by_name = asked(page, "name");
    await page.getByLabel("Name or serial number").fill("plate-1");
    await page.keyboard.press("Enter");
    expect(new URL((await by_name).url()).searchParams.get("name")).toBe("plate-1");
    await listed(page, ["PLATE-1"]);
    expect(page.url()).toMatch(/#\/results\?name=plate-1$/);

    // A link shows the same list.
    const by_verdict = asked(page, "verdict");
    await page.goto(`${server.url}/#/results?outcome=ok`);
    expect(new URL((await by_verdict).url()).searchParams.get("verdict")).toBe("ok");
    await listed(page, ["PLATE-1"]);
    expect(await page.getByLabel("Verdict or state").inputValue()).toBe("ok");
    await page.getByLabel("Verdict or state").selectOption("scanned");
    await listed(page, ["PLATE-2"]);
    await page.getByRole("button", { name: "Clear the filter" }).click();
    await listed(page, ["PLATE-2", "PLATE-1"]);

    const by_day = asked(page, "from_ms");
    await page.getByLabel("From day").fill("2100-01-01");
    await by_day;
    await page.getByText("No result matches the filter.").waitFor();
    expect(page.url()).toMatch(/#\/results\?from=2100-01-01$/);
    await context.close();
    expect(complaints).toEqual([]);
  },
  STATION_MS,
);
