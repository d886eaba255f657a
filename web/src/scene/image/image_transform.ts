/**
 * Where an image lies in its place on the screen.
 *
 * Places are CSS pixels from the top-left corner of the place; image positions are pixels of the frame, pixel (0, 0)
 * being the centre of the top-left pixel.
 */

export interface Size {
  readonly width: number;
  readonly height: number;
}

export interface ImageTransform {
  /** CSS pixels per pixel of the frame. */
  readonly scale: number;
  /** Place of the image's top-left corner (of pixel −0.5, −0.5). */
  readonly left: number;
  readonly top: number;
}

/** A pixel of the frame is never larger on the screen, CSS px. */
export const LARGEST_SCALE = 40;

/** An image is never zoomed out to less than this share of its fitted size. */
const SMALLEST_OF_FIT = 0.5;

/** So much of the image stays in its place when it is moved, CSS px. */
const KEPT_IN_PLACE_PX = 40;

/** Place of a column of the frame. */
export function xOfU(view: ImageTransform, u_px: number): number {
  return view.left + (u_px + 0.5) * view.scale;
}

/** Place of a row of the frame. */
export function yOfV(view: ImageTransform, v_px: number): number {
  return view.top + (v_px + 0.5) * view.scale;
}

/** Column of the frame at a place. */
export function uOfX(view: ImageTransform, x: number): number {
  return (x - view.left) / view.scale - 0.5;
}

/** Row of the frame at a place. */
export function vOfY(view: ImageTransform, y: number): number {
  return (y - view.top) / view.scale - 0.5;
}

/** The whole image, as large as its place allows, in the middle. */
export function fitted(place: Size, image: Size): ImageTransform {
  if (image.width <= 0 || image.height <= 0 || place.width <= 0 || place.height <= 0) {
    return { scale: 1, left: 0, top: 0 };
  }
  return centred(Math.min(place.width / image.width, place.height / image.height), place, image);
}

/** The image at a scale, its middle in the middle of the place. */
export function centred(scale: number, place: Size, image: Size): ImageTransform {
  return {
    scale,
    left: (place.width - scale * image.width) / 2,
    top: (place.height - scale * image.height) / 2,
  };
}

/** Larger or smaller by `factor`; what lies at (x, y) stays there. */
export function zoomedAt(
  view: ImageTransform,
  factor: number,
  x: number,
  y: number,
  place: Size,
  image: Size,
): ImageTransform {
  const smallest = Math.min(1, SMALLEST_OF_FIT * fitted(place, image).scale);
  const scale = Math.min(LARGEST_SCALE, Math.max(smallest, view.scale * factor));
  const grown = scale / view.scale;
  const zoomed = { scale, left: x - (x - view.left) * grown, top: y - (y - view.top) * grown };
  return kept(zoomed, place, image);
}

/** Moved by CSS pixels, but never out of sight. */
export function panned(view: ImageTransform, dx: number, dy: number, place: Size, image: Size): ImageTransform {
  return kept({ scale: view.scale, left: view.left + dx, top: view.top + dy }, place, image);
}

function kept(view: ImageTransform, place: Size, image: Size): ImageTransform {
  const within = (start: number, length: number, room: number) =>
    Math.min(room - KEPT_IN_PLACE_PX, Math.max(KEPT_IN_PLACE_PX - length, start));
  return {
    scale: view.scale,
    left: within(view.left, view.scale * image.width, place.width),
    top: within(view.top, view.scale * image.height, place.height),
  };
}
