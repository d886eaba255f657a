/**
 * Decodes JPEG images at the resolution at which they are displayed.
 *
 * A JPEG consists of blocks of 8 × 8 pixels, which can be decoded to 1 × 1 to 8 × 8 pixels, each the mean of the area
 * it covers. An image displayed at a third of its size is decoded at three eighths, with a quarter of the work and no
 * visible loss. Browsers without `ImageDecoder` decode at full resolution.
 */

/** Full resolution, in eighths. */
export const FULL_EIGHTHS = 8;

/** A decoded JPEG and its resolution. */
export interface Decoded {
  bitmap: ImageBitmap;
  /** Columns and rows of `bitmap` per column and row of the JPEG; those at the edge may be partial. */
  share: number;
}

/** Sufficient resolution, in eighths, if a pixel of the JPEG is displayed `scale` device pixels wide. */
export function eighthsFor(scale: number): number {
  return Math.min(FULL_EIGHTHS, Math.max(1, Math.ceil(FULL_EIGHTHS * scale - 1e-6)));
}

/** Decodes at a resolution given in eighths, or at full resolution. */
export async function decodeJpeg(
  data: Uint8Array<ArrayBuffer>,
  width_px: number,
  height_px: number,
  eighths: number,
): Promise<Decoded> {
  const bitmap =
    "ImageDecoder" in globalThis
      ? await decodedAt(data, width_px, height_px, eighths)
      : await createImageBitmap(new Blob([data], { type: "image/jpeg" }));
  // Partial pixels at the edge count as whole ones in `bitmap`.
  const decoded_eighths = Math.max(1, Math.floor((FULL_EIGHTHS * bitmap.width) / width_px));
  return { bitmap, share: decoded_eighths / FULL_EIGHTHS };
}

async function decodedAt(
  data: Uint8Array<ArrayBuffer>,
  width_px: number,
  height_px: number,
  eighths: number,
): Promise<ImageBitmap> {
  const size = (length_px: number) => Math.ceil((length_px * eighths) / FULL_EIGHTHS);
  const wanted = { desiredWidth: size(width_px), desiredHeight: size(height_px) };
  const decoder = new ImageDecoder({ data, type: "image/jpeg", ...(eighths < FULL_EIGHTHS && wanted) });
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
