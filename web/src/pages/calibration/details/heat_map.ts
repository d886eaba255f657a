/** Draws signed values over the image, with a diverging scale from blue (negative) over grey to orange (positive). */

/** The smallest 1, 2 or 5 times a power of ten that is at least `largest`: the end of a scale. */
export function niceCeiling(largest: number): number {
  if (!(largest > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(largest));
  return ([1, 2, 5, 10].find((lead) => lead * power >= largest * (1 - 1e-9)) ?? 10) * power;
}

type Colour = readonly [number, number, number];
const NEGATIVE: Colour = [86, 180, 233];
const ZERO: Colour = [92, 96, 100];
const POSITIVE: Colour = [230, 159, 0];

/** Colour of `value` on a scale that ends at ±`end`. */
export function divergingColour(value: number, end: number): string {
  const share = Math.max(-1, Math.min(1, value / end));
  const to = share < 0 ? NEGATIVE : POSITIVE;
  const mixed = ZERO.map((zero, idx) => Math.round(zero + Math.abs(share) * ((to[idx] ?? zero) - zero)));
  return `rgb(${mixed.join(" ")})`;
}

/** Fills a canvas with a grid of values; `null` stays dark. */
export function drawGrid(
  canvas: HTMLCanvasElement,
  grid: { columns: number; rows: number; values: readonly (number | null | undefined)[] },
  end: number,
): void {
  const context = clearedContext(canvas);
  if (!context) return;
  const [width, height] = [canvas.width / grid.columns, canvas.height / grid.rows];
  grid.values.forEach((value, idx) => {
    if (value == null) return;
    const [column, row] = [idx % grid.columns, Math.floor(idx / grid.columns)];
    context.fillStyle = divergingColour(value, end);
    // Half a pixel of overlap avoids visible seams.
    context.fillRect(column * width, row * height, width + 0.5, height + 0.5);
  });
}

/** Draws values as dots over the image. */
export function drawDots(
  canvas: HTMLCanvasElement,
  image: { width_px: number; height_px: number },
  points: Iterable<readonly [u: number, v: number, value: number]>,
  end: number,
): void {
  const context = clearedContext(canvas);
  if (!context) return;
  const scale = canvas.width / image.width_px;
  const size = Math.max(2, canvas.width / 220);
  for (const [u, v, value] of points) {
    context.fillStyle = divergingColour(value, end);
    context.fillRect((u + 0.5) * scale - size / 2, (v + 0.5) * scale - size / 2, size, size);
  }
}

/** Draws residuals as arrows from the detected points, enlarged `factor` times. */
export function drawArrows(
  canvas: HTMLCanvasElement,
  image: { width_px: number; height_px: number },
  arrows: readonly (readonly number[])[],
  factor: number,
): void {
  const context = clearedContext(canvas);
  if (!context) return;
  const scale = canvas.width / image.width_px;
  context.strokeStyle = "#d5dade";
  context.lineWidth = Math.max(1, canvas.width / 700);
  context.beginPath();
  for (const [u = 0, v = 0, du = 0, dv = 0] of arrows) {
    context.moveTo((u + 0.5) * scale, (v + 0.5) * scale);
    context.lineTo((u + 0.5 + factor * du) * scale, (v + 0.5 + factor * dv) * scale);
  }
  context.stroke();
}

function clearedContext(canvas: HTMLCanvasElement): CanvasRenderingContext2D | undefined {
  const context = canvas.getContext("2d");
  context?.clearRect(0, 0, canvas.width, canvas.height);
  return context ?? undefined;
}
