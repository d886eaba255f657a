/** Marks on charts of values over parts. */

import type uPlot from "uplot";

/** A horizontal line over the whole chart. */
export function drawAcross(plot: uPlot, value: number, stroke: string, dash: number[]): void {
  const { ctx, bbox } = plot;
  const y = plot.valToPos(value, "y", true);
  ctx.save();
  ctx.strokeStyle = stroke;
  ctx.lineWidth = 1.5 * devicePixelRatio;
  ctx.setLineDash(dash);
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.restore();
}

/** A dot, or a cross for NOT OK and INVALID: distinguishable without colour. */
export function drawSign(ctx: CanvasRenderingContext2D, x: number, y: number, r: number, bad: boolean): void {
  ctx.beginPath();
  if (bad) {
    ctx.lineWidth *= 2;
    ctx.moveTo(x - r, y - r);
    ctx.lineTo(x + r, y + r);
    ctx.moveTo(x + r, y - r);
    ctx.lineTo(x - r, y + r);
    ctx.stroke();
  } else {
    ctx.arc(x, y, r, 0, 2 * Math.PI);
    ctx.fill();
  }
}

/** The value of a colour of the theme. */
export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
