/** Draws a control chart: values of successive parts, control and specification limits, violations of run rules. */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { colour, drawAcross, drawSign } from "../../scene/plot/chart_marks";
import { decimal } from "../../units";
import { type ChartData, extent, type Line, type LineName } from "./chart_data";

const POINT_RADIUS_PX = 4;

/** Margin of the y axis at least, in the unit of the values: axes show three decimals. */
const LEAST_AIR = 1e-3;

/** Room for the names of lines at the right end. */
const NAMES_PX = 52;

const DASHES: Record<LineName, number[]> = {
  centre: [],
  lower_control: [10, 6],
  upper_control: [10, 6],
  lower_limit: [2, 5],
  upper_limit: [2, 5],
};

export interface ChartOptions {
  height_px: number;
  language: string;
  /** Short names of the lines. */
  names: Record<LineName, string>;
  onPick: (idx: number) => void;
}

export class ControlChartPlot {
  private readonly plot: uPlot;
  private readonly observer: ResizeObserver;

  constructor(
    container: HTMLElement,
    private readonly data: ChartData,
    private readonly options: ChartOptions,
  ) {
    const written = (value: number) => decimal(value, 3, options.language);
    const axis = { stroke: colour("--ink-2"), grid: { stroke: colour("--line"), width: 1 } };
    const size = () => ({ width: Math.max(200, container.clientWidth), height: options.height_px });
    const numbers = data.values.map((_, idx) => idx + 1);
    this.plot = new uPlot(
      {
        ...size(),
        padding: [null, NAMES_PX, null, null],
        scales: { x: { time: false, range: [0.4, numbers.length + 0.6] }, y: { range: this.range() } },
        axes: [
          {
            ...axis,
            incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000],
            values: (_, at) => at.map((x) => (x % 1 ? "" : `${x}`)),
          },
          { ...axis, size: 78, values: (_, at) => at.map(written) },
        ],
        legend: { show: false },
        cursor: { points: { show: false } },
        series: [{}, { stroke: colour("--line-strong"), width: 1, points: { show: false } }],
        hooks: { draw: [() => this.drawPoints()], drawClear: [() => this.drawLines()] },
      },
      [numbers, [...data.values]],
      container,
    );
    this.plot.over.addEventListener("click", () => {
      const idx = this.plot.cursor.idx;
      if (idx != null) options.onPick(idx);
    });
    this.observer = new ResizeObserver(() => this.plot.setSize(size()));
    this.observer.observe(container);
  }

  dispose(): void {
    this.observer.disconnect();
    this.plot.destroy();
  }

  /** Range of the y axis: values and lines, with a margin. */
  private range(): [number, number] {
    const [low, high] = extent([...this.data.values, ...this.data.lines.map(({ value }) => value)]);
    const air = Math.max(0.1 * (high - low), LEAST_AIR);
    return [this.data.from_zero ? 0 : low - air, high + air];
  }

  private drawLines(): void {
    for (const line of this.data.lines) {
      drawAcross(
        this.plot,
        line.value,
        colour(line.name === "centre" ? "--line-strong" : "--ink"),
        DASHES[line.name],
      );
      this.drawName(line);
    }
  }

  private drawName({ name, value }: Line): void {
    const { ctx, bbox } = this.plot;
    ctx.save();
    ctx.fillStyle = colour("--ink-2");
    ctx.font = `${12 * devicePixelRatio}px sans-serif`;
    // Specification limits have their names inside, since they may lie close to the other lines.
    const outside = name !== "lower_limit" && name !== "upper_limit";
    ctx.textAlign = outside ? "left" : "right";
    ctx.textBaseline = outside ? "middle" : "bottom";
    const x = bbox.left + bbox.width + (outside ? 4 : -4) * devicePixelRatio;
    ctx.fillText(this.options.names[name], x, this.plot.valToPos(value, "y", true));
    ctx.restore();
  }

  private drawPoints(): void {
    const { ctx } = this.plot;
    const r = POINT_RADIUS_PX * devicePixelRatio;
    ctx.save();
    ctx.font = `${12 * devicePixelRatio}px sans-serif`;
    ctx.textAlign = "center";
    ctx.textBaseline = "bottom";
    this.data.values.forEach((value, idx) => {
      if (value === null) return;
      const rules = this.data.violated.get(idx);
      const [x, y] = [this.plot.valToPos(idx + 1, "x", true), this.plot.valToPos(value, "y", true)];
      ctx.strokeStyle = ctx.fillStyle = colour(rules ? "--alarm" : "--ink-2");
      ctx.lineWidth = 1.5 * devicePixelRatio;
      drawSign(ctx, x, y, rules ? 1.3 * r : r, rules !== undefined);
      if (rules) ctx.fillText(rules.join(","), x, y - 1.6 * r);
    });
    ctx.restore();
  }
}
