/** Draws a trend: values with uncertainty for successive parts, with tolerance limits. */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { colour, drawAcross, drawSign } from "../../scene/plot/chart_marks";
import { decimal } from "../../units";
import type { Trend, TrendPoint } from "./trend_data";

/** Height of the chart. */
const HEIGHT_PX = 260;
const POINT_RADIUS_PX = 5;

export class TrendChart {
  private readonly plot: uPlot;
  private readonly observer: ResizeObserver;

  constructor(
    container: HTMLElement,
    private readonly trend: Trend,
    language: string,
    onPick: (point: TrendPoint) => void,
  ) {
    const written = (value: number) => decimal(value, 3, language);
    const axis = { stroke: colour("--ink-2"), grid: { stroke: colour("--line"), width: 1 } };
    this.plot = new uPlot(
      {
        width: Math.max(200, container.clientWidth),
        height: HEIGHT_PX,
        scales: { x: { time: false, range: [0.4, trend.points.length + 0.6] }, y: { range: this.range() } },
        axes: [
          { ...axis, incrs: [1, 2, 5, 10, 20, 50, 100], values: (_, at) => at.map((x) => (x % 1 ? "" : `${x}`)) },
          { ...axis, size: 78, values: (_, at) => at.map(written) },
        ],
        legend: { show: false },
        cursor: { points: { show: false } },
        series: [{}, { stroke: colour("--line-strong"), width: 1, points: { show: false } }],
        hooks: { draw: [() => this.drawPoints()], drawClear: [() => this.drawLimits()] },
      },
      this.columns(),
      container,
    );
    this.plot.over.addEventListener("click", () => {
      const point = trend.points[this.plot.cursor.idx ?? -1];
      if (point) onPick(point);
    });
    this.observer = new ResizeObserver(() =>
      this.plot.setSize({ width: Math.max(200, container.clientWidth), height: HEIGHT_PX }),
    );
    this.observer.observe(container);
  }

  dispose(): void {
    this.observer.disconnect();
    this.plot.destroy();
  }

  private columns(): [number[], number[]] {
    return [this.trend.points.map((_, at) => at + 1), this.trend.points.map((point) => point.value)];
  }

  /** Range of the y axis: values with uncertainty and limits, with a margin. */
  private range(): [number, number] {
    const { points, nominal, tolerance } = this.trend;
    const ends = points.flatMap(({ value, u }) => [value - u, value + u]);
    if (nominal !== undefined) ends.push(nominal - (tolerance ?? 0), nominal + (tolerance ?? 0));
    const [low, high] = [Math.min(...ends), Math.max(...ends)];
    const air = Math.max(0.12 * (high - low), 1e-3);
    return [low - air, high + air];
  }

  private drawLimits(): void {
    const { nominal, tolerance } = this.trend;
    if (nominal === undefined) return;
    drawAcross(this.plot, nominal, colour("--line-strong"), [2, 6]);
    if (tolerance === undefined) return;
    for (const limit of [nominal - tolerance, nominal + tolerance])
      drawAcross(this.plot, limit, colour("--ink"), [10, 6]);
  }

  private drawPoints(): void {
    const { ctx } = this.plot;
    ctx.save();
    this.trend.points.forEach((point, at) => {
      const x = this.plot.valToPos(at + 1, "x", true);
      const y = this.plot.valToPos(point.value, "y", true);
      const ink = colour(point.bad ? "--alarm" : "--ink-2");
      ctx.strokeStyle = ctx.fillStyle = ink;
      ctx.lineWidth = 1.5 * devicePixelRatio;
      ctx.beginPath();
      ctx.moveTo(x, this.plot.valToPos(point.value - point.u, "y", true));
      ctx.lineTo(x, this.plot.valToPos(point.value + point.u, "y", true));
      ctx.stroke();
      drawSign(ctx, x, y, POINT_RADIUS_PX * devicePixelRatio, point.bad);
    });
    ctx.restore();
  }
}
