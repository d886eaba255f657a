/** Runs in the page of `six_million.ts`. */

import { CloudViewer } from "../../src/scene/view/viewer";
import { decode } from "../../src/stream/protocol";
import { blockBytes } from "../../tests/scene/blocks";

/** Blocks a second: a camera at 120 Hz. */
const RATE_HZ = 120;

const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));

async function measure(n_blocks: number, n_points: number, draw: boolean) {
  const { drawArrays } = WebGL2RenderingContext.prototype;
  if (!draw) WebGL2RenderingContext.prototype.drawArrays = () => undefined;
  const host = document.createElement("div");
  Object.assign(host.style, { width: "1000px", height: "640px", position: "relative" });
  document.body.append(host);
  const viewer = new CloudViewer(host);
  // Encoded before, so that only what a page does is measured.
  const bytes = new Uint8Array(blockBytes(profile(n_points)));
  const sent = performance.now();
  let next = 0;
  let in_order = true;
  while (next < n_blocks || viewer.statistics().n_waiting_blocks > 0) {
    const due = Math.min(n_blocks, Math.floor(((performance.now() - sent) / 1000) * RATE_HZ));
    for (; next < due; next++) {
      const block = decode(message(bytes, next));
      if (block?.kind !== "points") throw new Error("no block");
      in_order &&= block.block === viewer.cloud.n_blocks + viewer.statistics().n_waiting_blocks;
      viewer.append(block);
    }
    await nextFrame();
  }
  const streamed_s = (performance.now() - sent) / 1000;
  const frame_ms = [...viewer.statistics().frame_ms];
  for (let frame = 0; frame < 60; frame++) {
    viewer.canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
    await nextFrame();
  }
  WebGL2RenderingContext.prototype.drawArrays = drawArrays;
  const turning_ms = viewer.statistics().frame_ms.slice(frame_ms.length);
  while (viewer.statistics().n_drawn < viewer.statistics().n_points) await nextFrame();
  const { n_points: shown, n_drawn } = viewer.statistics();
  return { n_points: shown, n_blocks: viewer.cloud.n_blocks, in_order, streamed_s, n_drawn, frame_ms, turning_ms };
}

/** A wavy surface under five lines. */
function profile(n_points: number) {
  const points = Array.from({ length: n_points }, (_, idx) => {
    const order = (idx % 5) - 2;
    const x = -100 + (200 * idx) / n_points;
    return {
      xyz_mm: [x, 20 * order, 400 - 8 * Math.cos(x / 15)] as [number, number, number],
      order,
      intensity: 120,
      sigma_class: 120,
      along_px: idx % 1280,
    };
  });
  return { block: 0, frame: 0, position_mm: 0, points };
}

/** The block of another row: moved along y, with its own number. */
function message(bytes: Uint8Array, number: number): ArrayBuffer {
  const copy = bytes.slice().buffer;
  const view = new DataView(copy);
  view.setUint32(4, number, true);
  view.setUint32(32, number, true);
  view.setFloat32(44, view.getFloat32(44, true) + 0.04 * number, true);
  return copy;
}

Object.assign(globalThis, { measure });
