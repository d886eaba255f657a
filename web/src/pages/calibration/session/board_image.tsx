/** The live image with the corners of the newest detection over it. */

import { useEffect, useRef } from "preact/hooks";
import { useApp } from "../../../app";
import { CameraImage } from "../../../scene/image/camera_image";
import { type ImageTransform, xOfU, yOfV } from "../../../scene/image/image_transform";
import { text } from "../../../text";
import type { LiveBoard } from "./live_board";
import type { Corner } from "./session_state";

/** For a hand-held board, 15 images per second at half the resolution are sufficient. */
const WANTED = { stream: "image", max_rate_hz: 15, scale: 2 } as const;

/** Colour of the corners: visible on black, white and grey squares. */
const CORNER_COLOUR = "#F0E442";

export function BoardImage({ board }: { board: LiveBoard }) {
  const { stream } = useApp();
  const container = useRef<HTMLDivElement>(null);
  const shown = useRef<CameraImage>(null);
  useEffect(() => {
    if (!container.current) return;
    const image = new CameraImage(container.current);
    shown.current = image;
    image.lines_shown = false;
    image.draw_over = (context, view) => drawCorners(context, view, board.detection.peek()?.corners ?? []);
    const unsubscribe = stream.subscribe(WANTED, (message) => {
      if (!("kind" in message) || message.kind !== "image") return;
      if (board.runs) image.show(message);
    });
    const unsubscribe_detection = board.detection.subscribe(() => image.redraw());
    return () => {
      unsubscribe();
      unsubscribe_detection();
      image.dispose();
    };
  }, [board]);
  // Without the live view an old image could be mistaken for the current one.
  const runs = board.runs;
  useEffect(() => {
    if (!runs) shown.current?.clear();
  }, [runs]);
  const words = text.value.calibration;
  return (
    <div class="data-view board-image live-data" ref={container} role="img" aria-label={words.image_label}>
      {!runs && <p class="no-live">{words.no_live}</p>}
    </div>
  );
}

function drawCorners(context: CanvasRenderingContext2D, view: ImageTransform, corners: readonly Corner[]): void {
  context.strokeStyle = CORNER_COLOUR;
  context.lineWidth = 1.5;
  context.beginPath();
  let row_before: number | undefined;
  for (const [, row = 0, u = 0, v = 0] of corners) {
    const [x, y] = [xOfU(view, u), yOfV(view, v)];
    if (row === row_before) context.lineTo(x, y);
    else context.moveTo(x, y);
    row_before = row;
  }
  context.globalAlpha = 0.5;
  context.stroke();
  context.globalAlpha = 1;
  context.fillStyle = CORNER_COLOUR;
  for (const [, , u = 0, v = 0] of corners) {
    context.beginPath();
    context.arc(xOfU(view, u), yOfV(view, v), 2.5, 0, 2 * Math.PI);
    context.fill();
  }
}
