/** Draws the centrelines of a frame over its image in the colours of the orders, each order labelled once. */

import type { ImageMessage, Line } from "../../stream/protocol";
import { NO_ORDER, orderColour, orderName } from "../../theme";
import { type ImageTransform, xOfU, yOfV } from "./image_transform";

/** Width of a centreline, CSS px. */
const LINE_PX = 1.5;

/** Scale from which each point is drawn. */
const POINTS_FROM_SCALE = 6;
const POINT_RADIUS_PX = 2.5;

/** Neighbouring points of a line are one pixel apart; larger distances are gaps. */
const GAP_PX = 1.5;

/** Points closer than this to the previous one are skipped, because they are not visible, device px. */
const APART_PX = 0.6;

/** Minimum length of a labelled line, points. */
const NAMED_FROM_POINTS = 60;

const LABEL_FONT = "600 12px system-ui, 'DejaVu Sans', sans-serif";

/** Draws all lines whose order is not hidden. */
export function drawCentrelines(
  context: CanvasRenderingContext2D,
  view: ImageTransform,
  image: ImageMessage,
  hidden: ReadonlySet<number>,
): void {
  const along_u = runAlongU(image);
  context.lineWidth = LINE_PX;
  context.lineJoin = "round";
  for (const line of image.lines) {
    if (hidden.has(line.order)) continue;
    context.strokeStyle = orderColour(line.order);
    strokeLine(context, view, image, line, along_u);
    if (view.scale >= POINTS_FROM_SCALE) fillPoints(context, view, image, line);
  }
  nameOrders(context, view, image, hidden, along_u);
}

/** Whether the lines of a frame run along the image rows. */
export function runAlongU(image: ImageMessage): boolean {
  const { points } = image;
  let [along_u, along_v] = [0, 0];
  for (const { first, n_points } of image.lines) {
    const [start, end] = [2 * first, 2 * (first + n_points - 1)];
    along_u += Math.abs((points[end] ?? 0) - (points[start] ?? 0));
    along_v += Math.abs((points[end + 1] ?? 0) - (points[start + 1] ?? 0));
  }
  return along_u >= along_v;
}

function strokeLine(
  context: CanvasRenderingContext2D,
  view: ImageTransform,
  image: ImageMessage,
  line: Line,
  along_u: boolean,
): void {
  const { points, units_per_px } = image;
  const gap = GAP_PX * units_per_px;
  const apart = APART_PX / devicePixelRatio;
  const end = 2 * (line.first + line.n_points);
  let before = Number.NEGATIVE_INFINITY;
  let [drawn_x, drawn_y] = [0, 0];
  context.beginPath();
  for (let at = 2 * line.first; at < end; at += 2) {
    const along = points[along_u ? at : at + 1] ?? 0;
    const begins = Math.abs(along - before) > gap;
    const next = points[along_u ? at + 2 : at + 3] ?? 0;
    const ends = at + 2 >= end || Math.abs(next - along) > gap;
    before = along;
    const x = xOfU(view, (points[at] ?? 0) / units_per_px);
    const y = yOfV(view, (points[at + 1] ?? 0) / units_per_px);
    if (!begins && !ends && Math.abs(x - drawn_x) < apart && Math.abs(y - drawn_y) < apart) continue;
    [drawn_x, drawn_y] = [x, y];
    if (begins) context.moveTo(x, y);
    else context.lineTo(x, y);
  }
  context.stroke();
}

function fillPoints(
  context: CanvasRenderingContext2D,
  view: ImageTransform,
  image: ImageMessage,
  line: Line,
): void {
  const { points, units_per_px } = image;
  context.fillStyle = orderColour(line.order);
  context.beginPath();
  for (let at = 2 * line.first; at < 2 * (line.first + line.n_points); at += 2) {
    const x = xOfU(view, (points[at] ?? 0) / units_per_px);
    const y = yOfV(view, (points[at + 1] ?? 0) / units_per_px);
    context.moveTo(x + POINT_RADIUS_PX, y);
    context.arc(x, y, POINT_RADIUS_PX, 0, 2 * Math.PI);
  }
  context.fill();
}

/** Labels each order at the start of its first long line. */
function nameOrders(
  context: CanvasRenderingContext2D,
  view: ImageTransform,
  image: ImageMessage,
  hidden: ReadonlySet<number>,
  along_u: boolean,
): void {
  const named: number[] = [];
  context.font = LABEL_FONT;
  context.lineWidth = 3;
  context.strokeStyle = "#14171a";
  context.textAlign = "left";
  context.textBaseline = "bottom";
  for (const line of image.lines) {
    if (line.order === NO_ORDER || hidden.has(line.order) || line.n_points < NAMED_FROM_POINTS) continue;
    if (named.includes(line.order)) continue;
    named.push(line.order);
    const at = 2 * line.first;
    const x = xOfU(view, (image.points[at] ?? 0) / image.units_per_px) + (along_u ? 4 : 8);
    const y = yOfV(view, (image.points[at + 1] ?? 0) / image.units_per_px) - (along_u ? 7 : 0);
    const name = orderName(line.order);
    context.strokeText(name, x, y);
    context.fillStyle = orderColour(line.order);
    context.fillText(name, x, y);
  }
}
