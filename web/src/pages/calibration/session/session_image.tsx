/** An image of a session with the detected points drawn over it. */

import { useEffect, useRef } from "preact/hooks";
import { orderColour } from "../../../theme";
import type { Session } from "./session_state";

/** Column, row and order of a point; without an order the dot is yellow. */
export type Dot = readonly [u: number, v: number, order: number | undefined];

interface Properties {
  session: Session;
  artifact: string;
  label: string;
  dots: readonly Dot[];
}

/** Visible on black, white and grey squares, and different from the colours of the orders. */
const NO_ORDER_COLOUR = "#F0E442";

/** Size of a dot, px of the canvas. */
const DOT_PX = 3;

const WIDTH_PX = 480;

export function SessionImage({ session, artifact, label, dots }: Properties) {
  const { width_px, height_px } = session.body;
  const canvas = useRef<HTMLCanvasElement>(null);
  const height = Math.round((WIDTH_PX * height_px) / Math.max(1, width_px));
  useEffect(() => {
    const context = canvas.current?.getContext("2d");
    if (!context) return;
    context.clearRect(0, 0, WIDTH_PX, height);
    const scale = WIDTH_PX / width_px;
    for (const [u, v, order] of dots) {
      context.fillStyle = order === undefined ? NO_ORDER_COLOUR : orderColour(order);
      context.fillRect((u + 0.5) * scale - DOT_PX / 2, (v + 0.5) * scale - DOT_PX / 2, DOT_PX, DOT_PX);
    }
  }, [artifact, dots.length, dots[0]?.[2], height]);
  return (
    <div class="data-view image">
      <img
        src={`/api/v1/calibration-sessions/${session.id}/images/${artifact}`}
        alt={label}
        loading="lazy"
        decoding="async"
        width={width_px}
        height={height_px}
      />
      <canvas ref={canvas} width={WIDTH_PX} height={height} />
    </div>
  );
}
