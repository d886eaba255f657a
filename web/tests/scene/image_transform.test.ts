import { expect, test } from "vitest";
import {
  fitted,
  LARGEST_SCALE,
  panned,
  uOfX,
  vOfY,
  xOfU,
  yOfV,
  zoomedAt,
} from "../../src/scene/image/image_transform";

const PLACE = { width: 800, height: 400 };
const PICTURE = { width: 1280, height: 1024 };

test("the fitted image fills its place in one direction and lies in the middle", () => {
  const view = fitted(PLACE, PICTURE);
  expect(view.scale).toBeCloseTo(400 / 1024, 12);
  expect(view.top).toBeCloseTo(0, 12);
  expect(view.left).toBeCloseTo((800 - 500) / 2, 9);
});

test("the corners of the image are half a pixel outside of the first and last pixel's centre", () => {
  const view = fitted(PLACE, PICTURE);
  expect(xOfU(view, -0.5)).toBeCloseTo(view.left, 9);
  expect(yOfV(view, 1023.5)).toBeCloseTo(400, 9);
});

test("screen and image are each other's inverse, at every zoom", () => {
  let view = fitted(PLACE, PICTURE);
  for (const factor of [1, 3.7, 9, 0.2]) {
    view = zoomedAt(view, factor, 311, 97, PLACE, PICTURE);
    for (const at of [-3.25, 0, 17.5, 1279]) {
      expect(uOfX(view, xOfU(view, at))).toBeCloseTo(at, 9);
      expect(vOfY(view, yOfV(view, at))).toBeCloseTo(at, 9);
    }
  }
});

test("zooming keeps what is under the pointer there, and ends at the limits", () => {
  const view = fitted(PLACE, PICTURE);
  const [u, v] = [uOfX(view, 311), vOfY(view, 97)];
  const zoomed = zoomedAt(view, 4, 311, 97, PLACE, PICTURE);
  expect(zoomed.scale).toBeCloseTo(4 * view.scale, 12);
  expect([xOfU(zoomed, u), yOfV(zoomed, v)]).toEqual([expect.closeTo(311, 9), expect.closeTo(97, 9)]);
  expect(zoomedAt(view, 1e9, 311, 97, PLACE, PICTURE).scale).toBe(LARGEST_SCALE);
  expect(zoomedAt(view, 1e-9, 311, 97, PLACE, PICTURE).scale).toBeCloseTo(view.scale / 2, 12);
});

test("an image that is pushed away stays within reach", () => {
  const view = fitted(PLACE, PICTURE);
  const right_end = panned(view, 1e6, 1e6, PLACE, PICTURE);
  expect([right_end.left, right_end.top]).toEqual([760, 360]);
  const left_end = panned(view, -1e6, -1e6, PLACE, PICTURE);
  expect(left_end.left + 1280 * left_end.scale).toBeCloseTo(40, 9);
});
