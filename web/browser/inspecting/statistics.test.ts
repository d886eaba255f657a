/** Statistics of a characteristic over inspections, as a quality engineer sees them, and their export. */

import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { blockRecipe, DEFECT_MM, HEIGHT_MM, placeBlock } from "../support/block";
import { englishIn } from "../support/german";
import { calibrated, expectAccessibleInBoth, launch, NO_GRAPHICS, picture, visit } from "../support/harness";
import type { Server } from "../support/server";

const STATION_MS = 300_000;

/** Heights of the parts of the study, mm. */
const PARTS_MM = [HEIGHT_MM - 0.02, HEIGHT_MM, HEIGHT_MM + 0.02];
const TRIALS = 3;

let server: Server;
let browser: Browser;
let study_id: string;

beforeAll(async () => {
  [server, browser] = await Promise.all([calibrated(), launch(NO_GRAPHICS)]);
  const recipe = blockRecipe(DEFECT_MM);
  await server.call("POST", "/api/v1/recipes", { id: "block", reason: "first article", recipe });
  const parts = PARTS_MM.map((_, idx) => `M-${idx}`);
  const gauge_rr = { recipe: "block", characteristic: "height", parts, operators: [], n_trials: TRIALS };
  const study = { name: "Height gauge", plan: { gauge_rr } };
  study_id = (await server.call<{ id: string }>("POST", "/api/v1/studies", study)).id;
  for (let trial = 0; trial < TRIALS; trial += 1) {
    for (const [idx, height_mm] of PARTS_MM.entries()) {
      await placeBlock(server, height_mm);
      await server.job("/api/v1/inspections", { recipe: "block", serial: `M-${idx}`, order: "msa" });
    }
  }
  await placeBlock(server, HEIGHT_MM - 8 * DEFECT_MM);
  await server.job("/api/v1/inspections", { recipe: "block", serial: "X-1" });
}, 600_000);

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

test(
  "from an inspection to its control chart, the capability and the type-1 study",
  async () => {
    const { page, context, complaints } = await visit(browser, server.url, "#/inspections?serial=X-1");
    await page.getByRole("link", { name: "X-1", exact: true }).click();
    await page
      .locator("[data-characteristic=height]")
      .getByRole("link", { name: /^Statistics/ })
      .click();
    await page.getByRole("heading", { name: "Statistics of height, Block", level: 1 }).waitFor();

    // The part that is far out violates rule 1, in words and with a link.
    await page.locator(".chart canvas").nth(1).waitFor();
    const control = page.getByRole("region", { name: "Control chart" });
    expect(await control.getAttribute("data-violations")).not.toBe("0");
    const beyond = control.locator("tr[data-rule='1']");
    expect(await beyond.textContent()).toMatch(/^1one value beyond 3 σ \(part 10\)X-1/);
    await control.getByText("Fewer than 25 values").waitFor();
    const label = await control.locator(".chart").first().getAttribute("aria-label");
    expect(label).toMatch(/^10 values, mean 8\.\d{4} mm, control limits \d\.\d{4} mm and \d\.\d{4} mm$/);
    const capability = page.getByRole("region", { name: "Process capability" });
    for (const index of ["Cp", "Cpk", "Pp", "Ppk"])
      expect(await capability.locator(`[data-index=${index}] td`).first().textContent()).toMatch(/^−?\d+\.\d\d$/);
    expect(await page.getByRole("alert").count()).toBe(0);
    await expectAccessibleInBoth(page);
    await picture(page, "statistics");

    // Those of one order are one; the selection stands in the address.
    await page.getByLabel("Production order").fill("msa");
    await page.keyboard.press("Enter");
    await control.locator(".chart[aria-label^='9 values']").first().waitFor();
    expect(page.url()).toMatch(/#\/statistics\/block\?characteristic=height&order=msa$/);

    const type_1 = page.getByRole("region", { name: "Type-1 study" });
    await type_1.getByText("Select one part by its serial number above.").waitFor();
    await page.getByLabel("Serial number").fill("M-1");
    await page.keyboard.press("Enter");
    await type_1.getByText("Enter the value of the part from its certificate.").waitFor();
    await type_1.getByLabel("Value from the certificate").fill(String(HEIGHT_MM));
    await page.keyboard.press("Enter");
    await type_1.locator("[data-verdict=undecided]", { hasText: "Undecided" }).waitFor();
    expect(await type_1.locator("dd").nth(2).textContent()).toMatch(/^3\s*$/);
    await expectAccessibleInBoth(page);
    await type_1.scrollIntoViewIfNeeded();
    await picture(page, "statistics-studies");

    // Nothing selected: said, not a fault.
    await page.getByLabel("Serial number").fill("none");
    await page.keyboard.press("Enter");
    await page.locator(".not-possible").first().waitFor();
    await context.close();
    expect(complaints).toEqual([]);
  },
  STATION_MS,
);

test("statistics lead to the gauge R&R study of the characteristic, which has the one table of it", async () => {
  const hash = "#/statistics/block?characteristic=height";
  const { page, context, complaints } = await visit(browser, server.url, hash);
  await page.getByRole("region", { name: "Gauge R&R" }).getByRole("link").click();
  const form = page.getByRole("region", { name: "New study" });
  await form.getByText("Enter a name.").waitFor();
  expect(await form.getByLabel("Kind").inputValue()).toBe("gauge_rr");
  await form.locator("option", { hasText: "height" }).waitFor({ state: "attached" });
  expect(await form.getByLabel("Characteristic").inputValue()).toBe("height");
  await form.getByLabel("Name").fill("Another");
  await form.getByLabel(/^Serial numbers/).fill("P-1, P-2");
  await form.getByRole("button", { name: "Create study" }).click();
  await page.getByText("Part P-2: 0 of 3 inspections").waitFor();

  await page.goto(`${server.url}/#/studies/${study_id}`);
  await page.getByText("3 parts × 1 operator × 3 trials").waitFor();
  const figures = page.getByRole("region", { name: "Results" });
  expect(await figures.locator("tbody tr").count()).toBe(4);
  // Parts differ by 20 µm, the station repeats within a few.
  const share = await figures.locator("[data-component=part_variation] td").nth(2).textContent();
  expect(Number.parseFloat(share ?? "")).toBeGreaterThan(90);
  await expectAccessibleInBoth(page);
  await picture(page, "study-gauge-rr");
  await context.close();
  expect(complaints).toEqual([]);
});

test("statistics fit a phone, and are German for Germans", async () => {
  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, locale: "de-DE" };
  const hash = `#/statistics/block?characteristic=height&order=msa&serial=M-1&reference=${HEIGHT_MM}`;
  const { page, context, complaints } = await visit(browser, server.url, hash, phone);
  await page.locator(".chart canvas").nth(1).waitFor();
  await page.locator("[data-verdict=undecided]").first().waitFor();
  const narrow = () => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
  expect([await narrow(), await englishIn(page, "main")]).toEqual([true, []]);
  await picture(page, "statistics-phone");
  await page.setViewportSize({ width: 1280, height: 800 });
  await page.goto(`${server.url}/#/statistics/block?characteristic=height`);
  await page.locator("tr[data-rule='1']").waitFor();
  expect(await englishIn(page, "main")).toEqual([]);
  await picture(page, "statistics-german");
  await page.goto(`${server.url}/#/statistics/unknown`);
  await page.getByRole("alert").waitFor();
  await context.close();
  expect(complaints).toEqual([]);
});
