/**
 * Plots z over x of all orders of a profile. uPlot draws the axes and handles zooming; the points are drawn into its
 * canvas directly from the message, without copying.
 */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { ProfileMessage } from "../../stream/protocol";
import { orderColour, orderName } from "../../theme";
import { acrossOrders, nearestProfilePoint, neighbour } from "./nearest";
import { SteadyRange } from "./steady_range";

/** A point is selected within this distance of the pointer, CSS px. */
const POINTER_RADIUS_PX = 24;

/** Points closer than this to the previous one are skipped, device px. */
const APART_PX = 1;

/** Step of the arrow keys with Shift, points. */
const LONG_STEP = 20;

/** Smallest spans of the axes, mm. */
const LEAST_ALONG_MM = 5;
const LEAST_Z_MM = 0.5;

const AXIS = {
  stroke: "#c4cad0",
  grid: { stroke: "#2f363c", width: 1 },
  ticks: { stroke: "#454d55", width: 1 },
  font: "12px system-ui, 'DejaVu Sans', sans-serif",
  labelFont: "12px system-ui, 'DejaVu Sans', sans-serif",
};

export interface PlotLabels {
  along: (axis: "x" | "y") => string;
  z: string;
  number: (value: number) => string;
}

/** Dummy data for uPlot; the points are drawn by `paint`. */
const NO_DATA: uPlot.AlignedData = [
  [0, 1],
  [null, null],
];

const givenRange: uPlot.Range.Function = (_plot, min, max) => [min ?? 0, max ?? 1];

type Span = readonly [number, number];

export class ProfilePlot {
  private readonly plot: uPlot;
  private readonly resized: ResizeObserver;
  private readonly listening = new AbortController();
  private readonly along_range = new SteadyRange(LEAST_ALONG_MM);
  private readonly z_range = new SteadyRange(LEAST_Z_MM);
  private zoomed: { along: Span; z: Span } | undefined;
  private profile: ProfileMessage | undefined;
  private marked: number | undefined;
  private pinned: readonly number[] = [];
  private frame_request = 0;

  /** `pointed` gets the index of the profile point under the pointer. */
  constructor(
    private readonly container: HTMLElement,
    private labels: PlotLabels,
    private readonly hidden: ReadonlySet<number>,
    private readonly pointed: (idx: number | undefined) => void,
  ) {
    this.plot = new uPlot(this.options(), NO_DATA, container);
    this.resized = new ResizeObserver(() => {
      if (container.clientWidth > 0)
        this.plot.setSize({ width: container.clientWidth, height: container.clientHeight });
    });
    this.resized.observe(container);
    const { signal } = this.listening;
    container.addEventListener("keydown", (event) => this.onKey(event), { signal });
    this.plot.over.addEventListener("pointermove", (event) => this.onPointer(event), { signal });
    this.plot.over.addEventListener("pointerleave", () => this.pointed(undefined), { signal });
    this.plot.over.addEventListener("dblclick", () => this.wholeRange(), { signal });
  }

  /** Shows a profile in the next animation frame; `undefined` clears the plot. */
  show(profile: ProfileMessage | undefined): void {
    this.profile = profile;
    this.redraw();
  }

  /** Marks a point of the displayed profile. */
  mark(idx: number | undefined): void {
    if (idx === this.marked) return;
    this.marked = idx;
    this.redraw();
  }

  /** Marks points until the next call. */
  pin(idxs: readonly number[]): void {
    this.pinned = idxs;
    this.redraw();
  }

  /** Changes the language of the labels. */
  setLabels(labels: PlotLabels): void {
    this.labels = labels;
    this.redraw();
  }

  redraw(): void {
    if (this.frame_request === 0) this.frame_request = requestAnimationFrame(() => this.draw());
  }

  /** Draws now if drawing was requested; for callers inside an animation frame. */
  drawNow(): void {
    if (this.frame_request === 0) return;
    cancelAnimationFrame(this.frame_request);
    this.draw();
  }

  dispose(): void {
    cancelAnimationFrame(this.frame_request);
    this.listening.abort();
    this.resized.disconnect();
    this.plot.destroy();
    this.profile = undefined;
  }

  private options(): uPlot.Options {
    const container = this.container;
    const values = (_plot: uPlot, splits: number[]) => splits.map((value) => this.labels.number(value));
    return {
      width: Math.max(100, container.clientWidth),
      height: Math.max(80, container.clientHeight),
      legend: { show: false },
      cursor: {
        points: { show: false },
        drag: { x: true, y: true, uni: 24, setScale: false },
        bind: { dblclick: () => null },
      },
      select: { show: true, left: 0, top: 0, width: 0, height: 0 },
      // Near the camera is up, so that parts appear upright.
      scales: { x: { time: false, range: givenRange }, y: { range: givenRange, dir: -1 } },
      axes: [
        { ...AXIS, values, size: 34, label: this.labels.along("x"), labelSize: 18, labelGap: 0 },
        { ...AXIS, values, size: 58, label: this.labels.z, labelSize: 18, labelGap: 0 },
      ],
      series: [{}, { show: false }],
      hooks: { draw: [(plot) => this.paint(plot)], setSelect: [(plot) => this.select(plot)] },
    };
  }

  private draw(): void {
    this.frame_request = 0;
    if (!this.zoomed) this.followData();
    const [along, z] = [this.zoomed?.along ?? this.along_range.value, this.zoomed?.z ?? this.z_range.value];
    const [across, up] = this.plot.axes;
    if (across) across.label = this.labels.along(this.profile?.along ?? "x");
    if (up) up.label = this.labels.z;
    const { x, y } = this.plot.scales;
    if (along && z && (x?.min !== along[0] || x?.max !== along[1] || y?.min !== z[0] || y?.max !== z[1])) {
      this.plot.batch(() => {
        this.plot.setScale("x", { min: along[0], max: along[1] });
        this.plot.setScale("y", { min: z[0], max: z[1] });
      });
    } else this.plot.redraw(false, false);
  }

  /** Adapts the axes to the displayed profile. */
  private followData(): void {
    const { profile } = this;
    if (!profile) return;
    const along = profile.along === "x" ? profile.x_mm : profile.y_mm;
    const extent = [Infinity, -Infinity, Infinity, -Infinity] as [number, number, number, number];
    for (const range of profile.orders) {
      if (this.hidden.has(range.order)) continue;
      for (let idx = range.first; idx < range.first + range.n_points; idx++) {
        const [x, z] = [along[idx] ?? 0, profile.z_mm[idx] ?? 0];
        if (x < extent[0]) extent[0] = x;
        if (x > extent[1]) extent[1] = x;
        if (z < extent[2]) extent[2] = z;
        if (z > extent[3]) extent[3] = z;
      }
    }
    this.along_range.follow(extent[0], extent[1]);
    this.z_range.follow(extent[2], extent[3]);
  }

  private paint(plot: uPlot): void {
    const { profile } = this;
    if (!profile) return;
    const context = plot.ctx;
    const along = profile.along === "x" ? profile.x_mm : profile.y_mm;
    const axis = profile.along === "x" ? 0 : 1;
    const gap = 1.5 * profile.units_per_px;
    // Same as `valToPos` for a linear scale, but fast enough for thousands of points.
    const [from_x, from_y] = [plot.scales.x?.min ?? 0, plot.scales.y?.min ?? 0];
    const [left, top] = [plot.valToPos(from_x, "x", true), plot.valToPos(from_y, "y", true)];
    const to_x = plot.valToPos(from_x + 1, "x", true) - left;
    const to_y = plot.valToPos(from_y + 1, "y", true) - top;
    context.save();
    context.beginPath();
    context.rect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height);
    context.clip();
    context.lineJoin = "round";
    for (const range of profile.orders) {
      if (this.hidden.has(range.order) || range.n_points === 0) continue;
      context.strokeStyle = orderColour(range.order);
      context.lineWidth = 1.5 * devicePixelRatio;
      context.beginPath();
      const end = range.first + range.n_points;
      let before = Number.NEGATIVE_INFINITY;
      let [drawn_x, drawn_y] = [0, 0];
      for (let idx = range.first; idx < end; idx++) {
        const seen = profile.pixels[2 * idx + axis] ?? 0;
        const begins = Math.abs(seen - before) > gap;
        const ends = idx + 1 >= end || Math.abs((profile.pixels[2 * (idx + 1) + axis] ?? 0) - seen) > gap;
        before = seen;
        const x = left + to_x * ((along[idx] ?? 0) - from_x);
        const y = top + to_y * ((profile.z_mm[idx] ?? 0) - from_y);
        const near = Math.abs(x - drawn_x) < APART_PX && Math.abs(y - drawn_y) < APART_PX;
        if (near && !begins && !ends) continue;
        [drawn_x, drawn_y] = [x, y];
        if (begins) context.moveTo(x, y);
        else context.lineTo(x, y);
      }
      context.stroke();
    }
    for (const range of profile.orders) if (!this.hidden.has(range.order)) this.name(plot, profile, range);
    for (const idx of this.pinned) this.paintRing(plot, profile, idx);
    if (this.marked !== undefined) this.paintMark(plot, profile, this.marked);
    context.restore();
  }

  /** Labels an order at the start of its curve. */
  private name(
    plot: uPlot,
    profile: ProfileMessage,
    range: { order: number; first: number; n_points: number },
  ): void {
    if (range.n_points < LONG_STEP) return;
    const along = profile.along === "x" ? profile.x_mm : profile.y_mm;
    // Orders start at about the same x: labels are staggered, so that they do not overlap.
    const idx = this.nameAt(profile, range);
    const context = plot.ctx;
    const [x, y] = [plot.valToPos(along[idx] ?? 0, "x", true), plot.valToPos(profile.z_mm[idx] ?? 0, "y", true)];
    context.font = `600 ${12 * devicePixelRatio}px system-ui, 'DejaVu Sans', sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "bottom";
    context.strokeStyle = "#14171a";
    context.lineWidth = 3 * devicePixelRatio;
    context.strokeText(orderName(range.order), x, y - 5 * devicePixelRatio);
    context.fillStyle = orderColour(range.order);
    context.fillText(orderName(range.order), x, y - 5 * devicePixelRatio);
  }

  private nameAt(profile: ProfileMessage, range: { order: number; first: number; n_points: number }): number {
    const [axis, room] = profile.along === "x" ? [0, profile.width_px] : [1, profile.height_px];
    const wanted = room * profile.units_per_px * Math.min(0.9, 0.06 + 0.06 * Math.max(0, range.order + 2));
    const end = range.first + range.n_points - 1;
    let idx = range.first;
    while (idx < end && (profile.pixels[2 * idx + axis] ?? 0) < wanted) idx += 1;
    return idx;
  }

  private paintMark(plot: uPlot, profile: ProfileMessage, idx: number): void {
    const along = profile.along === "x" ? profile.x_mm : profile.y_mm;
    if (along[idx] === undefined) return;
    const context = plot.ctx;
    const x = plot.valToPos(along[idx], "x", true);
    context.strokeStyle = "#ffffff";
    context.lineWidth = 1.5 * devicePixelRatio;
    context.beginPath();
    context.moveTo(x, plot.bbox.top);
    context.lineTo(x, plot.bbox.top + plot.bbox.height);
    context.globalAlpha = 0.5;
    context.stroke();
    context.globalAlpha = 1;
    this.paintRing(plot, profile, idx);
  }

  private paintRing(plot: uPlot, profile: ProfileMessage, idx: number): void {
    const along = (profile.along === "x" ? profile.x_mm : profile.y_mm)[idx];
    if (along === undefined) return;
    const context = plot.ctx;
    context.strokeStyle = "#ffffff";
    context.lineWidth = 1.5 * devicePixelRatio;
    context.beginPath();
    const [x, y] = [plot.valToPos(along, "x", true), plot.valToPos(profile.z_mm[idx] ?? 0, "y", true)];
    context.arc(x, y, 6 * devicePixelRatio, 0, 2 * Math.PI);
    context.stroke();
  }

  private onPointer(event: PointerEvent): void {
    const { profile, plot } = this;
    if (!profile) return;
    const box = plot.over.getBoundingClientRect();
    const [left, top] = [event.clientX - box.left, event.clientY - box.top];
    const square = (along: number, z: number) =>
      (plot.valToPos(along, "x") - left) ** 2 + (plot.valToPos(z, "y") - top) ** 2;
    this.pointed(nearestProfilePoint(profile, square, POINTER_RADIUS_PX, this.hidden));
  }

  private onKey(event: KeyboardEvent): void {
    const { profile } = this;
    if (!profile || event.ctrlKey || event.metaKey || event.altKey) return;
    const shown = profile.orders.find((range) => !this.hidden.has(range.order) && range.n_points > 0);
    if (!shown) return;
    const now = this.marked ?? shown.first + (shown.n_points >> 1);
    const step = event.shiftKey ? LONG_STEP : 1;
    const actions: Record<string, () => void> = {
      ArrowLeft: () => this.pointed(neighbour(profile, now, -step)),
      ArrowRight: () => this.pointed(neighbour(profile, now, step)),
      ArrowUp: () => this.pointed(acrossOrders(profile, now, 1, this.hidden)),
      ArrowDown: () => this.pointed(acrossOrders(profile, now, -1, this.hidden)),
      Escape: () => this.pointed(undefined),
      "0": () => this.wholeRange(),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private select(plot: uPlot): void {
    const { left, top, width, height } = plot.select;
    if (width < 4 && height < 4) return;
    const span = (scale: "x" | "y", start: number, length: number): Span => {
      const ends = [plot.posToVal(start, scale), plot.posToVal(start + length, scale)];
      return [Math.min(...ends), Math.max(...ends)];
    };
    this.zoomed = { along: span("x", left, width), z: span("y", top, height) };
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.redraw();
  }

  private wholeRange(): void {
    this.zoomed = undefined;
    this.redraw();
  }
}
