/** The live picture with the corners of the newest look over it. */

import { useEffect, useRef } from "preact/hooks";
import { useApp } from "../../../app";
import { CameraPicture } from "../../../scene/picture/camera_picture";
import { type PictureView, placeOfU, placeOfV } from "../../../scene/picture/picture_view";
import { text } from "../../../text";
import type { LiveBoard } from "./live_board";
import type { Corner } from "./session_state";

/** A hand-held board needs no thirty images per second, and half the resolution is sufficient. */
const WANTED = { stream: "image", max_rate_hz: 15, scale: 2 } as const;

/** Colour of the corners: seen well on black, white and grey squares. */
const CORNER_COLOUR = "#F0E442";

export function BoardPicture({ board }: { board: LiveBoard }) {
  const { stream } = useApp();
  const place = useRef<HTMLDivElement>(null);
  const shown = useRef<CameraPicture>(null);
  useEffect(() => {
    if (!place.current) return;
    const picture = new CameraPicture(place.current);
    shown.current = picture;
    picture.lines_shown = false;
    picture.draw_over = (context, view) => drawCorners(context, view, board.look.peek()?.corners ?? []);
    const unsubscribe = stream.subscribe(WANTED, (message) => {
      if (!("kind" in message) || message.kind !== "image") return;
      if (board.runs) picture.show(message);
    });
    const unlook = board.look.subscribe(() => picture.redraw());
    return () => {
      unsubscribe();
      unlook();
      picture.dispose();
    };
  }, [board]);
  // A picture that stands still while nothing is live would be taken for the board as it is now.
  const runs = board.runs;
  useEffect(() => {
    if (!runs) shown.current?.clear();
  }, [runs]);
  const words = text.value.calibration;
  return (
    <div class="data-view board-picture live-data" ref={place} role="img" aria-label={words.picture_label}>
      {!runs && <p class="no-live">{words.no_live}</p>}
    </div>
  );
}

function drawCorners(context: CanvasRenderingContext2D, view: PictureView, corners: readonly Corner[]): void {
  context.strokeStyle = CORNER_COLOUR;
  context.lineWidth = 1.5;
  context.beginPath();
  let row_before: number | undefined;
  for (const [, row = 0, u = 0, v = 0] of corners) {
    const [x, y] = [placeOfU(view, u), placeOfV(view, v)];
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
    context.arc(placeOfU(view, u), placeOfV(view, v), 2.5, 0, 2 * Math.PI);
    context.fill();
  }
}
