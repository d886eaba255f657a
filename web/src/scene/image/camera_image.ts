/**
 * The camera image, and on a second layer the centrelines of the same frame.
 *
 * Only the newest frame is decoded, at the displayed resolution; frames that arrive in the meantime replace each
 * other and are counted. Draws only after changes, at most once per animation frame. Its resources (a bitmap, two
 * canvases, one message) are freed in dispose().
 */

import type { ImageMessage } from "../../stream/protocol";
import { drawCentrelines } from "./centreline_layer";
import { listen } from "./image_input";
import {
  centred,
  fitted,
  type ImageTransform,
  panned,
  type Size,
  uOfX,
  vOfY,
  xOfU,
  yOfV,
  zoomedAt,
} from "./image_transform";
import { type Decoded, decodeJpeg, eighthsFor, FULL_EIGHTHS } from "./jpeg";
import { Zebra } from "./zebra";

/** Callbacks of the camera image. */
export interface ImageEvents {
  /** A frame was drawn. */
  drawn?(image: ImageMessage): void;
  /** The pointer moved to a position of the frame, px; `undefined`: it has left the image. */
  hovered?(at: { u_px: number; v_px: number } | undefined): void;
  /** The image was panned or zoomed. */
  viewed?(view: ImageTransform, is_fitted: boolean): void;
}

/** Grey levels of an image: `data[4 · (row · width + column)]`. */
export interface Greys {
  readonly data: ArrayLike<number>;
  readonly width: number;
  readonly height: number;
}

/** Draws an overlay on the image, in CSS px, after the centrelines. */
export type DrawOver = (context: CanvasRenderingContext2D, view: ImageTransform, image: ImageMessage) => void;

/** Scale below which low-quality smoothing skips pixels. */
const HALF = 0.5;

export class CameraImage {
  /** Number of frames replaced by a newer one before they were decoded. */
  skipped = 0;
  /** Orders whose lines are not drawn; call `redraw` after a change. */
  readonly hidden_orders = new Set<number>();
  /** Whether any centrelines are drawn. */
  lines_shown = true;
  /** Overlay on the image, such as the corners of a board. */
  draw_over: DrawOver | undefined;
  private readonly image_canvas = document.createElement("canvas");
  private readonly line_canvas = document.createElement("canvas");
  private readonly image_context: CanvasRenderingContext2D;
  private readonly line_context: CanvasRenderingContext2D;
  private readonly pixels: CanvasRenderingContext2D;
  private readonly resized: ResizeObserver;
  private readonly stop_listening: () => void;
  private container_size: Size = { width: 0, height: 0 };
  private view_: ImageTransform = { scale: 1, left: 0, top: 0 };
  private is_fitted = true;
  private zebra: Zebra | undefined;
  private marked: { u_px: number; v_px: number } | undefined;
  private frozen = false;
  private decoding = false;
  private waiting: ImageMessage | undefined;
  private shown: ({ image: ImageMessage; eighths: number } & Decoded) | undefined;
  private greys_: { of: ImageMessage; read: Promise<Greys | undefined> } | undefined;
  private drawn_pending = false;
  private frame_request = 0;
  private disposed = false;

  /** `container` is filled by the image; it must be positioned by CSS, as by the class `data-view`. */
  constructor(
    private readonly container: HTMLElement,
    private readonly events: ImageEvents = {},
  ) {
    this.image_context = contextOf(this.image_canvas, {});
    this.line_context = contextOf(this.line_canvas, {});
    this.pixels = contextOf(document.createElement("canvas"), { willReadFrequently: true });
    this.image_canvas.className = "layer image";
    this.line_canvas.className = "layer lines";
    for (const canvas of [this.image_canvas, this.line_canvas]) {
      canvas.style.position = "absolute";
      canvas.style.inset = "0";
      canvas.style.width = "100%";
      canvas.style.height = "100%";
    }
    container.append(this.image_canvas, this.line_canvas);
    this.resized = new ResizeObserver(() => this.resize());
    this.resized.observe(container);
    this.stop_listening = listen(container, {
      zoomAt: (factor, x, y) =>
        this.setTransform(zoomedAt(this.view_, factor, x, y, this.container_size, this.image_size), false),
      pan: (dx, dy) => this.setTransform(panned(this.view_, dx, dy, this.container_size, this.image_size), false),
      fit: () => this.fit(),
      point: (x, y) => this.point(x, y),
    });
    this.resize();
  }

  /** The displayed frame. */
  get frame(): ImageMessage | undefined {
    return this.shown?.image;
  }

  get view(): ImageTransform {
    return this.view_;
  }

  /** Shows a frame once the previous one is decoded, unless a newer one replaces it. */
  show(image: ImageMessage): void {
    if (this.frozen) return;
    if (this.decoding) {
      if (this.waiting) this.skipped += 1;
      this.waiting = image;
    } else void this.decode(image);
  }

  /** Freezes the displayed frame, even if a newer one is being decoded; or resumes. */
  freeze(frozen: boolean): void {
    this.frozen = frozen;
    this.waiting = undefined;
  }

  /** Clears the frame. */
  clear(): void {
    this.waiting = undefined;
    this.shown?.bitmap.close();
    this.shown = undefined;
    this.greys_ = undefined;
    this.redraw();
  }

  /** Fits the whole image into the container. */
  fit(): void {
    this.setTransform(fitted(this.container_size, this.image_size), true);
  }

  /** Sets the scale in CSS pixels per pixel of the frame, centred on the middle of the view. */
  zoomTo(scale: number): void {
    const { width, height } = this.container_size;
    const factor = scale / this.view_.scale;
    if (this.is_fitted) this.setTransform(centred(scale, this.container_size, this.image_size), false);
    else
      this.setTransform(
        zoomedAt(this.view_, factor, width / 2, height / 2, this.container_size, this.image_size),
        false,
      );
  }

  zoomBy(factor: number): void {
    this.zoomTo(this.view_.scale * factor);
  }

  /** Shows or hides stripes over saturated pixels. */
  showZebra(shown: boolean): void {
    this.zebra = shown ? new Zebra() : undefined;
    if (this.shown) this.zebra?.take(this.shown.bitmap);
    this.refine();
    this.redraw();
  }

  /** Marks a position of the frame with a cross. */
  mark(at: { u_px: number; v_px: number } | undefined): void {
    if (!at && !this.marked) return;
    this.marked = at;
    this.redraw();
  }

  /**
   * The grey levels of the displayed frame at the full resolution of the JPEG. The result is cached for the frame.
   */
  greys(): Promise<Greys | undefined> {
    const image = this.shown?.image;
    if (!image) return Promise.resolve(undefined);
    if (this.greys_?.of !== image) this.greys_ = { of: image, read: this.read(image) };
    return this.greys_.read;
  }

  /** Requests drawing in the next animation frame. */
  redraw(): void {
    if (this.frame_request === 0 && !this.disposed) {
      this.frame_request = requestAnimationFrame(() => this.draw());
    }
  }

  dispose(): void {
    this.disposed = true;
    cancelAnimationFrame(this.frame_request);
    this.resized.disconnect();
    this.stop_listening();
    this.waiting = undefined;
    this.shown?.bitmap.close();
    this.shown = undefined;
    this.greys_ = undefined;
    this.image_canvas.remove();
    this.line_canvas.remove();
  }

  private get image_size(): Size {
    const image = this.shown?.image;
    return { width: image?.width_px ?? 0, height: image?.height_px ?? 0 };
  }

  private async decode(image: ImageMessage): Promise<void> {
    this.decoding = true;
    try {
      this.take(image, await this.decoded(image, this.eighths_wanted));
    } catch {
      // A frame that cannot be decoded is skipped.
      this.skipped += 1;
    }
    this.decoding = false;
    const next = this.waiting;
    this.waiting = undefined;
    if (next && !this.disposed) void this.decode(next);
  }

  private async decoded(image: ImageMessage, eighths: number): Promise<Decoded & { eighths: number }> {
    return { ...(await decodeJpeg(image.jpeg, image.jpeg_width_px, image.jpeg_height_px, eighths)), eighths };
  }

  /** Resolution at which the JPEG must be decoded for the current scale, in eighths. */
  private get eighths_wanted(): number {
    // The scale is not known before the first frame; the zebra needs every pixel.
    if (!this.shown || this.zebra) return FULL_EIGHTHS;
    return eighthsFor(this.view_.scale * this.shown.image.scale * devicePixelRatio);
  }

  /** Decodes the displayed frame again if the current scale requires a higher resolution. */
  private refine(): void {
    const { shown } = this;
    const eighths = this.eighths_wanted;
    if (!shown || shown.eighths >= eighths) return;
    shown.eighths = eighths;
    const { image } = shown;
    const replace = (finer: Decoded) => {
      if (this.shown !== shown) {
        finer.bitmap.close();
        return;
      }
      shown.bitmap.close();
      Object.assign(shown, finer);
      this.zebra?.take(shown.bitmap);
      this.redraw();
    };
    // If this fails, the lower resolution stays.
    this.decoded(image, eighths).then(replace, () => undefined);
  }

  private async read(image: ImageMessage): Promise<Greys | undefined> {
    try {
      const { bitmap } = await this.decoded(image, FULL_EIGHTHS);
      const { canvas } = this.pixels;
      const { width, height } = bitmap;
      if (canvas.width !== width) canvas.width = width;
      if (canvas.height !== height) canvas.height = height;
      this.pixels.drawImage(bitmap, 0, 0);
      bitmap.close();
      return { data: this.pixels.getImageData(0, 0, width, height).data, width, height };
    } catch {
      return undefined;
    }
  }

  private take(image: ImageMessage, decoded: Decoded & { eighths: number }): void {
    if (this.disposed || this.frozen) {
      decoded.bitmap.close();
      return;
    }
    const before = this.shown?.image;
    this.shown?.bitmap.close();
    this.shown = { image, ...decoded };
    this.drawn_pending = true;
    this.zebra?.take(decoded.bitmap);
    const resized = before?.width_px !== image.width_px || before?.height_px !== image.height_px;
    if (resized) this.fit();
    this.refine();
    this.redraw();
  }

  private resize(): void {
    this.container_size = { width: this.container.clientWidth, height: this.container.clientHeight };
    for (const canvas of [this.image_canvas, this.line_canvas]) {
      canvas.width = Math.max(1, Math.round(this.container_size.width * devicePixelRatio));
      canvas.height = Math.max(1, Math.round(this.container_size.height * devicePixelRatio));
    }
    if (this.is_fitted) this.fit();
    else this.setTransform(panned(this.view_, 0, 0, this.container_size, this.image_size), false);
  }

  private setTransform(view: ImageTransform, is_fitted: boolean): void {
    this.view_ = view;
    this.is_fitted = is_fitted;
    // Touch scrolls the page while the whole image is visible, and pans the image otherwise.
    this.container.style.touchAction = is_fitted ? "pan-y" : "none";
    this.container.dataset.view = `${view.scale} ${view.left} ${view.top}`;
    this.events.viewed?.(view, is_fitted);
    this.refine();
    this.redraw();
  }

  private point(x: number | undefined, y: number): void {
    if (x === undefined || !this.shown) this.events.hovered?.(undefined);
    else this.events.hovered?.({ u_px: uOfX(this.view_, x), v_px: vOfY(this.view_, y) });
  }

  private draw(): void {
    this.frame_request = 0;
    const ratio = devicePixelRatio;
    for (const context of [this.image_context, this.line_context]) {
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.clearRect(0, 0, context.canvas.width, context.canvas.height);
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    if (!this.shown) return;
    const { image } = this.shown;
    this.drawImage(this.shown);
    if (this.lines_shown) drawCentrelines(this.line_context, this.view_, image, this.hidden_orders);
    this.draw_over?.(this.line_context, this.view_, image);
    if (this.marked) drawMark(this.line_context, this.view_, this.marked);
    if (this.drawn_pending) {
      this.drawn_pending = false;
      this.container.dataset.sequence = String(image.sequence);
      this.events.drawn?.(image);
    }
  }

  private drawImage({ image, bitmap, share }: { image: ImageMessage } & Decoded): void {
    const { scale, left, top } = this.view_;
    const [width, height] = [share * image.jpeg_width_px, share * image.jpeg_height_px];
    const to_scale = (scale * image.scale) / share;
    // Magnified pixels are drawn as squares, without interpolation.
    // At small scales pixels are averaged: thin lines would otherwise break into dots.
    this.image_context.imageSmoothingQuality = to_scale * devicePixelRatio < HALF ? "medium" : "low";
    this.image_context.imageSmoothingEnabled = scale * devicePixelRatio < 2;
    const shown = this.zebra?.canvas ?? bitmap;
    this.image_context.drawImage(shown, 0, 0, width, height, left, top, to_scale * width, to_scale * height);
  }
}

function drawMark(
  context: CanvasRenderingContext2D,
  view: ImageTransform,
  at: { u_px: number; v_px: number },
): void {
  const [x, y] = [xOfU(view, at.u_px), yOfV(view, at.v_px)];
  for (const [colour, width] of [
    ["#000", 3],
    ["#fff", 1.25],
  ] as const) {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    for (const [dx, dy] of [
      [1, 0],
      [-1, 0],
      [0, 1],
      [0, -1],
    ] as const) {
      context.moveTo(x + 7 * dx, y + 7 * dy);
      context.lineTo(x + 15 * dx, y + 15 * dy);
    }
    context.stroke();
  }
}

function contextOf(
  canvas: HTMLCanvasElement,
  settings: CanvasRenderingContext2DSettings,
): CanvasRenderingContext2D {
  const context = canvas.getContext("2d", settings);
  if (!context) throw new Error("this browser draws no 2D canvas");
  return context;
}
