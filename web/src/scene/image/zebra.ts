/**
 * Draws stripes over the saturated pixels of an image.
 *
 * Uses canvas compositing only, so that no pixels are copied into JavaScript memory. The mask of saturated pixels is
 * the inverse of 1 − grey, amplified until every grey level below the limit is white.
 */

/**
 * Grey levels from 253 on count as full scale, because JPEG rounds; colour dodge with 252 amplifies by 255 / 3, so that
 * 252 and less become white.
 */
const DODGE = "#fcfcfc";

/** Period of the stripes, px of the frame. */
const STRIPE_PERIOD_PX = 8;

/** Colour whose difference from white is red. */
const STRIPE_COLOUR = "#00ffff";

export class Zebra {
  readonly canvas = document.createElement("canvas");
  private readonly mask = document.createElement("canvas");
  private stripes: CanvasPattern | undefined;

  /** Draws the image with stripes on `canvas`. */
  take(image: ImageBitmap): void {
    const [mask, shown] = [this.mask.getContext("2d"), this.canvas.getContext("2d")];
    if (!mask || !shown) return;
    for (const canvas of [this.mask, this.canvas]) {
      if (canvas.width === image.width && canvas.height === image.height) continue;
      canvas.width = image.width;
      canvas.height = image.height;
    }
    this.stripes ??= stripes(mask);
    const { width, height } = image;
    const composite = (operation: GlobalCompositeOperation, fill: string | CanvasPattern) => {
      mask.globalCompositeOperation = operation;
      mask.fillStyle = fill;
      mask.fillRect(0, 0, width, height);
    };
    mask.globalCompositeOperation = "copy";
    mask.drawImage(image, 0, 0);
    composite("difference", "#ffffff");
    composite("color-dodge", DODGE);
    composite("difference", "#ffffff");
    if (this.stripes) composite("multiply", this.stripes);
    shown.globalCompositeOperation = "copy";
    shown.drawImage(image, 0, 0);
    shown.globalCompositeOperation = "difference";
    shown.drawImage(this.mask, 0, 0);
  }
}

function stripes(context: CanvasRenderingContext2D): CanvasPattern | undefined {
  const tile = document.createElement("canvas");
  tile.width = STRIPE_PERIOD_PX;
  tile.height = STRIPE_PERIOD_PX;
  const drawing = tile.getContext("2d");
  if (!drawing) return undefined;
  for (let row = 0; row < STRIPE_PERIOD_PX; row++) {
    for (let column = 0; column < STRIPE_PERIOD_PX; column++) {
      drawing.fillStyle = (row + column) % STRIPE_PERIOD_PX < STRIPE_PERIOD_PX / 2 ? STRIPE_COLOUR : "#000";
      drawing.fillRect(column, row, 1, 1);
    }
  }
  return context.createPattern(tile, "repeat") ?? undefined;
}
