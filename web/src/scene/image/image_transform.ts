/**
 * The transform from image to screen.
 *
 * Screen positions are CSS pixels from the top-left corner of the container; image positions are pixels of the frame,
 * with (0, 0) at the centre of the top-left pixel.
 */

export interface Size {
  readonly width: number;
  readonly height: number;
}

export interface ImageTransform {
  /** CSS pixels per pixel of the frame. */
  readonly scale: number;
  /** Screen position of the image's top-left corner (pixel −0.5, −0.5). */
  readonly left: number;
  readonly top: number;
}

/** Largest scale, CSS px per pixel of the frame. */
export const LARGEST_SCALE = 40;

/** Smallest scale relative to the fitted image. */
const SMALLEST_OF_FIT = 0.5;

/** Part of the image that stays visible when it is panned, CSS px. */
const MIN_VISIBLE_PX = 40;

/** Screen x of a column of the frame. */
export function xOfU(view: ImageTransform, u_px: number): number {
  return view.left + (u_px + 0.5) * view.scale;
}

/** Screen y of a row of the frame. */
export function yOfV(view: ImageTransform, v_px: number): number {
  return view.top + (v_px + 0.5) * view.scale;
}

/** Column of the frame at screen x. */
export function uOfX(view: ImageTransform, x: number): number {
  return (x - view.left) / view.scale - 0.5;
}

/** Row of the frame at screen y. */
export function vOfY(view: ImageTransform, y: number): number {
  return (y - view.top) / view.scale - 0.5;
}

/** The whole image, as large as possible, centred. */
export function fitted(container: Size, image: Size): ImageTransform {
  if (image.width <= 0 || image.height <= 0 || container.width <= 0 || container.height <= 0) {
    return { scale: 1, left: 0, top: 0 };
  }
  return centred(Math.min(container.width / image.width, container.height / image.height), container, image);
}

/** The image at a given scale, centred. */
export function centred(scale: number, container: Size, image: Size): ImageTransform {
  return {
    scale,
    left: (container.width - scale * image.width) / 2,
    top: (container.height - scale * image.height) / 2,
  };
}

/** Zoomed by `factor` about the screen position (x, y). */
export function zoomedAt(
  view: ImageTransform,
  factor: number,
  x: number,
  y: number,
  container: Size,
  image: Size,
): ImageTransform {
  const smallest = Math.min(1, SMALLEST_OF_FIT * fitted(container, image).scale);
  const scale = Math.min(LARGEST_SCALE, Math.max(smallest, view.scale * factor));
  const ratio = scale / view.scale;
  const zoomed = { scale, left: x - (x - view.left) * ratio, top: y - (y - view.top) * ratio };
  return clamped(zoomed, container, image);
}

/** Panned by CSS pixels; part of the image stays visible. */
export function panned(
  view: ImageTransform,
  dx: number,
  dy: number,
  container: Size,
  image: Size,
): ImageTransform {
  return clamped({ scale: view.scale, left: view.left + dx, top: view.top + dy }, container, image);
}

function clamped(view: ImageTransform, container: Size, image: Size): ImageTransform {
  const within = (start: number, length: number, room: number) =>
    Math.min(room - MIN_VISIBLE_PX, Math.max(MIN_VISIBLE_PX - length, start));
  return {
    scale: view.scale,
    left: within(view.left, view.scale * image.width, container.width),
    top: within(view.top, view.scale * image.height, container.height),
  };
}
