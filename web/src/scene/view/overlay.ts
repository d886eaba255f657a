/** SVG overlay of the cloud: axes, scale bar, picked points, labels of features, region, and the selection. */

import type { Box } from "../cloud/cloud";
import { type Projection, project } from "../cloud/picking";
import type { Rectangle } from "../cloud/region_pick";
import { dot, type Vec3, vec3 } from "../cloud/shapes";
import type { Orbit } from "./orbit";

type OnView = (at: Vec3) => [number, number, number];

const SVG = "http://www.w3.org/2000/svg";

/** Length of the axes and their distance from the corner, CSS px. */
const AXIS_PX = 28;
const CORNER_PX = 44;

/** Approximate width of the scale bar, CSS px. */
const BAR_PX = 120;

const AXES: readonly { name: string; direction: Vec3 }[] = [
  { name: "x", direction: [1, 0, 0] },
  { name: "y", direction: [0, 1, 0] },
  { name: "z", direction: [0, 0, 1] },
];

/** A label at a place of the cloud. */
export interface Label {
  id: string;
  text: string;
  at: Vec3;
  current: boolean;
}

/** What is drawn over the cloud. */
export interface Annotations {
  marks: readonly Vec3[];
  labels: readonly Label[];
  /** Corners of the region. */
  region: Box | undefined;
  /** Its dimensions along x, y and z. */
  dimensions: readonly string[];
  selection: Rectangle | undefined;
}

/** Edges of a box, by the bits of their corners. */
const EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((from) =>
  [1, 2, 4].filter((bit) => !(from & bit)).map((bit) => [from, from | bit] as const),
);

export class Overlay {
  private readonly svg = element("svg", { class: "cloud-overlay", "aria-hidden": "true" });
  private readonly marks = element("g", { class: "marks" });
  private readonly labels = element("g", { class: "labels" });
  private readonly region = element("path", { class: "region" });
  private readonly dimensions = element("g", { class: "dimensions" });
  private readonly selection = element("rect", { class: "selection" });
  private readonly axes = AXES.map(({ name }) => {
    const line = element("line", { class: "axis" });
    const letter = element("text", { class: "axis" });
    letter.textContent = name;
    return { line, letter };
  });
  private readonly bar = element("path", { class: "bar" });
  private readonly bar_text = document.createElement("span");

  /** `chosen` is called with the id of a label that was clicked. */
  constructor(
    host: HTMLElement,
    private readonly chosen: (id: string) => void = () => {},
  ) {
    for (const { line, letter } of this.axes) this.svg.append(line, letter);
    this.svg.append(this.bar, this.region, this.dimensions, this.labels, this.marks, this.selection);
    this.bar_text.className = "cloud-bar";
    host.append(this.svg, this.bar_text);
  }

  /** Redraws the overlay for a view of the given size. */
  draw(orbit: Orbit, clip: Projection, shown: Annotations, width_px: number, height_px: number): void {
    const onView = (at: Vec3) => project(clip, at, width_px, height_px);
    this.drawAxes(orbit, height_px);
    this.drawBar(orbit, width_px, height_px);
    this.drawMarks(onView, shown.marks);
    this.drawLabels(onView, shown.labels);
    this.drawRegion(onView, shown.region, shown.dimensions);
    this.drawSelection(shown.selection);
  }

  dispose(): void {
    this.svg.remove();
    this.bar_text.remove();
  }

  private drawAxes(orbit: Orbit, height_px: number): void {
    const { right, up } = orbit.basis();
    const [x0, y0] = [CORNER_PX, height_px - CORNER_PX];
    AXES.forEach(({ direction }, idx) => {
      const parts = this.axes[idx];
      if (!parts) return;
      const [x1, y1] = [x0 + AXIS_PX * dot(right, direction), y0 - AXIS_PX * dot(up, direction)];
      set(parts.line, { x1: x0, y1: y0, x2: x1, y2: y1 });
      set(parts.letter, { x: x0 + (x1 - x0) * 1.35, y: y0 + (y1 - y0) * 1.35 + 4 });
    });
  }

  /** Draws scale bar and axes on a canvas, for printing. */
  paint(context: CanvasRenderingContext2D, orbit: Orbit, width_px: number, height_px: number): void {
    const { left, right, y, label } = barOf(orbit, width_px, height_px);
    context.strokeStyle = context.fillStyle = "#ffffff";
    context.lineWidth = 2;
    context.font = "14px sans-serif";
    context.textAlign = "center";
    context.beginPath();
    context.moveTo(left, y - 5);
    context.lineTo(left, y);
    context.lineTo(right, y);
    context.lineTo(right, y - 5);
    context.stroke();
    context.fillText(label, (left + right) / 2, y - 9);
    const { right: across, up } = orbit.basis();
    const [x0, y0] = [CORNER_PX, height_px - CORNER_PX];
    for (const { name, direction } of AXES) {
      const [dx, dy] = [dot(across, direction), dot(up, direction)];
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x0 + AXIS_PX * dx, y0 - AXIS_PX * dy);
      context.stroke();
      context.fillText(name, x0 + 1.35 * AXIS_PX * dx, y0 - 1.35 * AXIS_PX * dy + 4);
    }
  }

  private drawBar(orbit: Orbit, width_px: number, height_px: number): void {
    const { left, right, y, label } = barOf(orbit, width_px, height_px);
    this.bar.setAttribute("d", `M${left},${y - 5}v5H${right}v-5`);
    this.bar_text.style.right = `${width_px - right}px`;
    this.bar_text.style.width = `${right - left}px`;
    this.bar_text.textContent = label;
  }

  private drawLabels(onView: OnView, labels: readonly Label[]): void {
    this.labels.replaceChildren(
      ...labels.map(({ id, text, at, current }) => {
        const [x, y] = onView(at);
        const group = element("g", { class: current ? "label current" : "label", "data-label": id });
        const dot = element("circle", { r: "5" });
        set(dot, { cx: x, cy: y });
        const word = element("text", {});
        set(word, { x: x + 10, y: y + 4 });
        word.textContent = text;
        group.append(dot, word);
        group.addEventListener("click", () => this.chosen(id));
        return group;
      }),
    );
  }

  private drawRegion(onView: OnView, region: Box | undefined, dimensions: readonly string[]): void {
    if (!region) {
      this.region.removeAttribute("d");
      this.dimensions.replaceChildren();
      return;
    }
    const corner = (bits: number): Vec3 =>
      vec3(([0, 1, 2] as const).map((axis) => ((bits >> axis) & 1 ? region.max : region.min)[axis]));
    const path = EDGES.map(([from, to]) => {
      const [[x0, y0], [x1, y1]] = [onView(corner(from)), onView(corner(to))];
      return `M${x0.toFixed(1)},${y0.toFixed(1)}L${x1.toFixed(1)},${y1.toFixed(1)}`;
    });
    this.region.setAttribute("d", path.join(""));
    // Beside the edges that meet in the lowest corner of the view, which is in front.
    const down = (bits: number) => onView(corner(bits))[1];
    const lowest = [0, 1, 2, 3, 4, 5, 6, 7].reduce((low, bits) => (down(bits) > down(low) ? bits : low), 0);
    const words = dimensions.map((dimension, axis) => {
      const [[x0, y0], [x1, y1]] = [onView(corner(lowest)), onView(corner(lowest ^ (1 << axis)))];
      const word = element("text", {});
      set(word, { x: (x0 + x1) / 2, y: (y0 + y1) / 2 + 16 });
      word.textContent = dimension;
      return word;
    });
    this.dimensions.replaceChildren(...words);
  }

  private drawSelection(selection: Rectangle | undefined): void {
    this.selection.setAttribute("visibility", selection ? "visible" : "hidden");
    if (!selection) return;
    const { left_px: x, top_px: y, right_px, bottom_px } = selection;
    set(this.selection, { x, y, width: right_px - x, height: bottom_px - y });
  }

  private drawMarks(onView: OnView, marks: readonly Vec3[]): void {
    const places = marks.map(onView);
    const parts: SVGElement[] = [];
    const [first, second] = places;
    if (first && second) {
      const line = element("line", { class: "between" });
      set(line, { x1: first[0], y1: first[1], x2: second[0], y2: second[1] });
      parts.push(line);
    }
    places.forEach(([x, y], idx) => {
      const ring = element("circle", { r: "6" });
      set(ring, { cx: x, cy: y });
      const letter = element("text", {});
      set(letter, { x: x + 9, y: y - 7 });
      letter.textContent = String(idx + 1);
      parts.push(ring, letter);
    });
    this.marks.replaceChildren(...parts);
  }
}

/** A scale bar of a round length in the lower right corner; in perspective it is valid at the target. */
function barOf(orbit: Orbit, width_px: number, height_px: number) {
  const px_per_mm = height_px / 2 / orbit.half_height_mm;
  const length_mm = roundLength(BAR_PX / px_per_mm);
  const [right, y] = [width_px - 16, height_px - 18];
  const label = length_mm < 0.1 ? `${Math.round(1000 * length_mm)} µm` : `${length_mm} mm`;
  return { left: right - length_mm * px_per_mm, right, y, label };
}

/** The largest of 1, 2, 5 · 10ⁿ that does not exceed a length. */
export function roundLength(length: number): number {
  const power = 10 ** Math.floor(Math.log10(length));
  const digit = [5, 2, 1].find((digit) => digit * power <= length * (1 + 1e-9)) ?? 1;
  return Number((digit * power).toPrecision(1));
}

function element(name: string, attributes: Record<string, string>): SVGElement {
  const made = document.createElementNS(SVG, name);
  set(made, attributes);
  return made;
}

function set(element: SVGElement, attributes: Record<string, string | number>): void {
  for (const [name, value] of Object.entries(attributes)) {
    element.setAttribute(name, typeof value === "number" ? value.toFixed(1) : value);
  }
}
