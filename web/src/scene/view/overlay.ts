/** SVG overlay of the cloud: axes, scale bar, picked points and the line between them. */

import { type Projection, project } from "../cloud/picking";
import { dot, type Vec3 } from "../cloud/shapes";
import type { Orbit } from "./orbit";

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

export class Overlay {
  private readonly svg = element("svg", { class: "cloud-overlay", "aria-hidden": "true" });
  private readonly marks = element("g", { class: "marks" });
  private readonly axes = AXES.map(({ name }) => {
    const line = element("line", { class: "axis" });
    const letter = element("text", { class: "axis" });
    letter.textContent = name;
    return { line, letter };
  });
  private readonly bar = element("path", { class: "bar" });
  private readonly bar_text = document.createElement("span");

  constructor(host: HTMLElement) {
    for (const { line, letter } of this.axes) this.svg.append(line, letter);
    this.svg.append(this.bar, this.marks);
    this.bar_text.className = "cloud-bar";
    host.append(this.svg, this.bar_text);
  }

  /** Redraws the overlay for a view of the given size. */
  draw(orbit: Orbit, clip: Projection, marks: readonly Vec3[], width_px: number, height_px: number): void {
    this.drawAxes(orbit, height_px);
    this.drawBar(orbit, width_px, height_px);
    this.drawMarks(clip, marks, width_px, height_px);
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

  private drawMarks(clip: Projection, marks: readonly Vec3[], width_px: number, height_px: number): void {
    const places = marks.map((mark) => project(clip, mark, width_px, height_px));
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
