/** The colours on the screen: a screenshot, read pixel by pixel. */

import type { BrowserContext, Locator, Page } from "playwright-core";
import { orderColour } from "../src/theme";

/** Orders of the simulated station. */
export const ORDERS = [-2, -1, 0, 1, 2];

/** A screenshot is lossless; pixels of the same colour are equal. */
const SAME = 2;

/** How many pixels of an element have each of the colours, `#rrggbb`. */
export async function pixelsOf(element: Locator, colours: readonly string[]): Promise<number[]> {
  const png = (await element.screenshot()).toString("base64");
  const blank = await blankPage(element.page().context());
  return await blank.evaluate(counted, { png, colours, same: SAME });
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
  return await pixelsOf(page.locator(".cloud-canvas canvas"), ORDERS.map(orderColour));
}

async function counted({ png, colours, same }: { png: string; colours: readonly string[]; same: number }) {
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
    const found = wanted.findIndex((rgb) =>
      rgb.every((value, idx) => Math.abs(value - (data[at + idx] ?? 0)) <= same),
    );
    if (found >= 0) counts[found] = (counts[found] ?? 0) + 1;
  }
  return counts;
}
