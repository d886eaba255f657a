/**
 * Stable states of the page look as they did: `golden/*.png`, written by `SHEAF_GOLDEN=write`.
 *
 * What changes from run to run is covered. Fonts differ between computers: where the page's font is another one, the
 * comparison is skipped with a message, because it would only show the font.
 */

import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { launch, PICTURES, visit } from "../support/harness";
import { Server } from "../support/server";

const GOLDEN = join(import.meta.dirname, "golden");
const WRITE = process.env.SHEAF_GOLDEN === "write";

/** A pixel differs if one of its colours is off by more: smoothing of edges is not a difference. */
const COLOUR_TOLERANCE = 40;

/** Share of pixels that may differ: less than one button's border, more than the smoothing of another Chromium. */
const SHARE_TOLERANCE = 0.004;

/** Width of a sample text may differ by so much before the font counts as another one, px. */
const FONT_TOLERANCE_PX = 0.5;

let server: Server;
let browser: Browser;

beforeAll(async () => {
  [server, browser] = await Promise.all([Server.start(), launch()]);
});

afterAll(async () => {
  await browser?.close();
  await server?.stop();
});

/** Width of a text in the page's two fonts, px. */
async function fontWidths(page: Page): Promise<number[]> {
  return await page.evaluate(() => {
    const context = document.createElement("canvas").getContext("2d");
    const mono = getComputedStyle(document.documentElement).getPropertyValue("--mono");
    const sans = getComputedStyle(document.body).fontFamily;
    return [sans, mono].map((family) => {
      if (!context) return 0;
      context.font = `40px ${family}`;
      return context.measureText("Sheaf 0123456789 AaÄäÖß −±µ").width;
    });
  });
}

async function fontsAreThoseOfGolden(page: Page): Promise<boolean> {
  const path = join(GOLDEN, "fonts.json");
  const widths = await fontWidths(page);
  if (WRITE) writeFileSync(path, `${JSON.stringify(widths)}\n`);
  const golden = JSON.parse(readFileSync(path, "utf8")) as number[];
  return golden.every((width, at) => Math.abs(width - (widths[at] ?? 0)) < FONT_TOLERANCE_PX);
}

/** Share of pixels that differ; 1 if the sizes do. Compared in the browser, which can decode the images. */
async function shareOfDifferentPixels(page: Page, a: Buffer, b: Buffer): Promise<number> {
  const pair = [a, b].map((png) => `data:image/png;base64,${png.toString("base64")}`);
  return await page.evaluate(
    async ([urls, tolerance]) => {
      const read = async (url: string) => {
        const image = new Image();
        image.src = url;
        await image.decode();
        const canvas = new OffscreenCanvas(image.width, image.height);
        const context = canvas.getContext("2d");
        context?.drawImage(image, 0, 0);
        return context?.getImageData(0, 0, image.width, image.height);
      };
      const [one, other] = [await read(urls[0] ?? ""), await read(urls[1] ?? "")];
      if (!one || !other || one.width !== other.width || one.height !== other.height) return 1;
      let different = 0;
      for (let at = 0; at < one.data.length; at += 4) {
        const off = [0, 1, 2].map((c) => Math.abs((one.data[at + c] ?? 0) - (other.data[at + c] ?? 0)));
        if (Math.max(...off) > tolerance) different += 1;
      }
      return (4 * different) / one.data.length;
    },
    [pair, COLOUR_TOLERANCE] as const,
  );
}

/** Places whose words change from run to run: addresses with a port, versions. */
const CHANGING = [".copy-line pre", ".version"];

const CASES = [
  { name: "operate-light", hash: "#/operate", colorScheme: "light", settled: "The station is not calibrated." },
  { name: "jobs-light", hash: "#/jobs", colorScheme: "light", settled: "No jobs yet" },
  { name: "settings-dark", hash: "#/settings", colorScheme: "dark", settled: "Interlock open" },
  { name: "help-light", hash: "#/help", colorScheme: "light", settled: "First steps" },
] as const;

test.for(CASES)("$name looks as it did", async ({ name, hash, colorScheme, settled }, context) => {
  mkdirSync(GOLDEN, { recursive: true });
  const { page, complaints, context: visitor } = await visit(browser, server.url, hash, { colorScheme });
  try {
    await page.locator(".bar", { hasText: "Operational.Initialized" }).waitFor();
    await page.getByText(settled).first().waitFor();
    await page.getByRole("button", { name: "No one in control" }).waitFor();
    if (!(await fontsAreThoseOfGolden(page))) {
      console.warn(`SKIPPED: ${name} cannot be compared, the fonts of this computer are not those of golden/`);
      context.skip();
    }
    const mask = CHANGING.map((selector) => page.locator(selector));
    const seen = await page.screenshot({ mask, animations: "disabled", caret: "hide" });
    const path = join(GOLDEN, `${name}.png`);
    if (WRITE) writeFileSync(path, seen);
    expect(existsSync(path), `${path} is missing: write it with SHEAF_GOLDEN=write, and look at it`).toBe(true);
    const share = await shareOfDifferentPixels(page, seen, readFileSync(path));
    if (share > SHARE_TOLERANCE) {
      mkdirSync(PICTURES, { recursive: true });
      writeFileSync(join(PICTURES, `${name}-differs.png`), seen);
    }
    expect(share, `share of different pixels; what was seen lies in ${PICTURES}`).toBeLessThanOrEqual(
      SHARE_TOLERANCE,
    );
    expect(complaints).toEqual([]);
  } finally {
    await visitor.close();
  }
});
