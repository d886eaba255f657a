/** Draws the histogram of a frame: 64 grey levels, counts on a logarithmic scale. */

/** Colour of the full-scale bin if it is not empty: saturation is abnormal. */
const FULL_SCALE_COLOUR = "#ff6b5e";
const BAR_COLOUR = "#b9c0c7";
const GRID_COLOUR = "#39414a";

export class HistogramView {
  private readonly context: CanvasRenderingContext2D | null;

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.context = canvas.getContext("2d");
  }

  draw(histogram: Uint32Array, n_saturated: number): void {
    const { context, canvas } = this;
    if (!context) return;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const ratio = devicePixelRatio;
    if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
    if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.fillStyle = GRID_COLOUR;
    for (const share of [0.25, 0.5, 0.75]) context.fillRect(Math.round(share * width), 0, 1, height);
    const most = Math.log10(1 + histogram.reduce((most, n) => Math.max(most, n), 1));
    const bar = width / histogram.length;
    for (const [bin, n] of histogram.entries()) {
      const full = bin === histogram.length - 1 && n_saturated > 0;
      context.fillStyle = full ? FULL_SCALE_COLOUR : BAR_COLOUR;
      const tall = (height * Math.log10(1 + n)) / most;
      context.fillRect(bin * bar, height - tall, Math.max(1, bar - 1), tall);
    }
  }
}
