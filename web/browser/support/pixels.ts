/** The colours on the screen: a screenshot, read pixel by pixel. */

import type { BrowserContext, Locator, Page } from "playwright-core";
import { orderColour } from "../../src/theme";

/** Orders of the simulated station. */
export const ORDERS = [-2, -1, 0, 1, 2];

/** A screenshot is lossless; pixels of the same colour are equal. */
const SAME = 2;

/** A shaded pixel is a darker one of the same colour: down to this fraction, and equal to within so much. */
const DARKEST_FRACTION = 0.3;
const SAME_SHADED = 6;

/** How many pixels of an element have each of the colours, `#rrggbb`. */
export async function pixelsOf(
  element: Locator,
  colours: readonly string[],
  { shaded } = { shaded: false },
): Promise<number[]> {
  const png = (await element.screenshot()).toString("base64");
  const blank = await blankPage(element.page().context());
  return await blank.evaluate(counted, {
    png,
    colours,
    same: shaded ? SAME_SHADED : SAME,
    darkest: shaded ? DARKEST_FRACTION : 1,
  });
}

const blanks = new WeakMap<BrowserContext, Page>();

/** A page without a content security policy, in which images are decoded. */
export async function blankPage(context: BrowserContext): Promise<Page> {
  const blank = blanks.get(context) ?? (await context.newPage());
  blanks.set(context, blank);
  return blank;
}

/** Pixels of the cloud in the colours of its orders, by order. */
export async function orderPixels(page: Page): Promise<number[]> {
  return await pixelsOf(page.locator(".cloud-canvas canvas"), ORDERS.map(orderColour), { shaded: true });
}

interface Counting {
  png: string;
  colours: readonly string[];
  same: number;
  darkest: number;
}

async function counted({ png, colours, same, darkest }: Counting) {
  const image = new Image();
  image.src = `data:image/png;base64,${png}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  canvas.width = image.width;
  canvas.height = image.height;
  const context = canvas.getContext("2d");
  if (!context) throw new Error("no canvas");
  context.drawImage(image, 0, 0);
  const { data } = context.getImageData(0, 0, image.width, image.height);
  const wanted = colours.map((hex) => [1, 3, 5].map((at) => Number.parseInt(hex.slice(at, at + 2), 16)));
  const counts = wanted.map(() => 0);
  for (let at = 0; at < data.length; at += 4) {
    const seen = [data[at] ?? 0, data[at + 1] ?? 0, data[at + 2] ?? 0];
    const found = wanted.findIndex((rgb) => {
      const light = darkest === 1 ? 1 : Math.max(...seen) / Math.max(...rgb);
      if (light < darkest || light > 1.02) return false;
      return rgb.every((value, idx) => Math.abs(light * value - (seen[idx] ?? 0)) <= same);
    });
    if (found >= 0) counts[found] = (counts[found] ?? 0) + 1;
  }
  return counts;
}
