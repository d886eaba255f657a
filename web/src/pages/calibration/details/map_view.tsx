/** A small canvas with data over the image, its scale, and a text alternative. */

import { useEffect, useRef } from "preact/hooks";
import { divergingColour } from "./heat_map";

interface Properties {
  /** Text alternative of the map, with its values. */
  label: string;
  /** Height over width. */
  aspect: number;
  draw: (canvas: HTMLCanvasElement) => void;
  /** The map is redrawn when one of these changes. */
  inputs: readonly unknown[];
  /** Text in the top left corner. */
  caption?: string;
}

const WIDTH_PX = 640;

export function MapView({ label, aspect, draw, inputs, caption }: Properties) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    if (canvas.current) draw(canvas.current);
  }, inputs);
  return (
    <div class="data-view map">
      {caption && <span class="caption">{caption}</span>}
      <canvas ref={canvas} width={WIDTH_PX} height={Math.round(WIDTH_PX * aspect)} role="img" aria-label={label} />
    </div>
  );
}

/** The legend of the colour scale. */
export function ScaleLegend(properties: {
  end: number;
  format: (value: number) => string;
  low: string;
  high: string;
}) {
  const { end, format, low, high } = properties;
  const stops = [-1, -0.5, 0, 0.5, 1];
  return (
    <div class="scale-legend">
      <span class="muted">{low}</span>
      {stops.map((stop) => (
        <span key={stop} class="stop">
          <span class="swatch" style={{ background: divergingColour(stop, 1) }} />
          <span class="number">{format(stop * end)}</span>
        </span>
      ))}
      <span class="muted">{high}</span>
    </div>
  );
}
