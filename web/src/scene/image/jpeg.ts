/**
 * JPEG to pixels, no larger than they are looked at.
 *
 * A JPEG is stored in blocks of 8 × 8, and a block can be turned into 1 × 1 to 8 × 8 pixels, each the mean of what it
 * covers. An image that is shown at a third of its size is decoded at three eighths: a fourth of the work, and nothing
 * that the screen has pixels for is missing. Browsers without `ImageDecoder` decode the whole.
 */

/** The finest: a pixel for every pixel. */
export const WHOLE = 8;

/** Pixels of a JPEG, and which share of its columns and rows they are. */
export interface Decoded {
  bitmap: ImageBitmap;
  /** Columns and rows of `bitmap` per column and row of the JPEG; the last ones may be cut. */
  share: number;
}

/** Eighths of the size that suffice where a pixel of the JPEG is `scale` pixels of the screen wide. */
export function eighthsFor(scale: number): number {
  return Math.min(WHOLE, Math.max(1, Math.ceil(WHOLE * scale - 1e-6)));
}

/** Decodes at so many eighths of the size, or at all of it. */
export async function decodeJpeg(
  jpeg: Uint8Array,
  width_px: number,
  height_px: number,
  eighths: number,
): Promise<Decoded> {
  const data = jpeg as Uint8Array<ArrayBuffer>;
  const bitmap =
    "ImageDecoder" in globalThis
      ? await decodedAt(data, width_px, height_px, eighths)
      : await createImageBitmap(new Blob([data], { type: "image/jpeg" }));
  // A part of a pixel at the edge is a whole one there.
  const got = Math.max(1, Math.floor((WHOLE * bitmap.width) / width_px));
  return { bitmap, share: got / WHOLE };
}

async function decodedAt(
  data: Uint8Array<ArrayBuffer>,
  width_px: number,
  height_px: number,
  eighths: number,
): Promise<ImageBitmap> {
  const size = (length_px: number) => Math.ceil((length_px * eighths) / WHOLE);
  const wanted = { desiredWidth: size(width_px), desiredHeight: size(height_px) };
  const decoder = new ImageDecoder({ data, type: "image/jpeg", ...(eighths < WHOLE && wanted) });
  try {
    const { image } = await decoder.decode();
    try {
      return await createImageBitmap(image);
    } finally {
      image.close();
    }
  } finally {
    decoder.close();
  }
}
