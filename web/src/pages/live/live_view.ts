/**
 * Connects the stream to the live page: image, lines and profile of the same frame, drawn by classes; values as signals
 * updated at most four times a second.
 */

import { signal } from "@preact/signals";
import { CameraImage } from "../../scene/image/camera_image";
import { nearestLinePoint, orderOfPoint, profilePointAt } from "../../scene/plot/nearest";
import { type PlotLabels, ProfilePlot } from "../../scene/plot/profile_plot";
import type { StreamConnection } from "../../stream/connection";
import type { ImageMessage, ProfileMessage } from "../../stream/protocol";
import type { DropCount } from "../../stream/text_messages";
import { LIVE_RATE_HZ, NO_ORDER } from "../../theme";
import { FrameRate } from "./image/frame_rate";
import { type Advice, adviceOf } from "./quality/advice";
import { HistogramView } from "./quality/histogram";
import { greyAt, type OrderQuality, qualityOf } from "./quality/quality";

/** Update interval of the displayed values, ms. */
const VALUES_EVERY_MS = 250;

/** Quality is updated only every n-th time, because it evaluates every pixel of an image. */
const QUALITY_EVERY = 3;

/** Profiles kept until the image of their frame is decoded. */
const KEPT_PROFILES = 6;

/** A line is selected within this distance of the pointer, CSS px. */
const POINTER_RADIUS_PX = 12;

export interface FrameValues {
  sequence: number;
  rate_hz: number;
  age_ms: number | undefined;
  position_mm: number;
  exposure_us: number;
  calibrated: boolean;
  laser_on: boolean;
  n_lines: number;
  n_saturated: number;
  advice: Advice | undefined;
  /** Frames received but not decoded, because a newer one had arrived. */
  skipped: number;
  dropped: readonly DropCount[];
}

/** Values at the pointer. */
export interface Readout {
  u_px: number;
  v_px: number;
  grey: number | undefined;
  order: number | undefined;
  /** The profile point of the same frame, in camera coordinates, mm. */
  point: { x_mm: number; y_mm: number; z_mm: number; sigma_mm: number } | undefined;
}

type Pointed = { in: "image"; u_px: number; v_px: number } | { in: "plot"; idx: number };

export class LiveView {
  readonly values = signal<FrameValues | undefined>(undefined);
  readonly quality = signal<readonly OrderQuality[]>([]);
  readonly readout = signal<Readout | undefined>(undefined);
  readonly frozen = signal(false);
  /** Whether there is something to plot. */
  readonly has_profile = signal(false);
  readonly zebra = signal(false);
  readonly scale = signal({ px: 1, is_fitted: true });
  /** Orders seen since the page was opened. */
  readonly orders = signal<readonly number[]>([]);
  readonly hidden = signal<ReadonlySet<number>>(new Set());
  readonly camera_image: CameraImage;
  private readonly plot: ProfilePlot;
  private readonly histogram: HistogramView;
  private readonly rate = new FrameRate();
  private readonly profiles: ProfileMessage[] = [];
  private readonly cleanups: (() => void)[] = [];
  private shown_profile: ProfileMessage | undefined;
  private pointed: Pointed | undefined;
  private ticks = 0;

  constructor(
    private readonly stream: StreamConnection,
    containers: { image: HTMLElement; plot: HTMLElement; histogram: HTMLCanvasElement },
    words: PlotLabels,
  ) {
    this.camera_image = new CameraImage(containers.image, {
      drawn: (image) => this.drawn(image),
      hovered: (at) => this.point(at && { in: "image", ...at }),
      viewed: (view, is_fitted) => (this.scale.value = { px: view.scale, is_fitted }),
    });
    this.plot = new ProfilePlot(containers.plot, words, this.camera_image.hidden_orders, (idx) =>
      this.point(idx === undefined ? undefined : { in: "plot", idx }),
    );
    this.histogram = new HistogramView(containers.histogram);
    this.cleanups.push(
      stream.subscribe({ stream: "image", max_rate_hz: LIVE_RATE_HZ }, (message) => {
        if ("kind" in message && message.kind === "image" && !this.frozen.peek()) this.camera_image.show(message);
      }),
      stream.subscribe({ stream: "profile", max_rate_hz: LIVE_RATE_HZ }, (message) => {
        if (!("kind" in message) || message.kind !== "profile") return;
        // The profile of the frozen frame may arrive after its image.
        if (!this.frozen.peek() || message.sequence === this.camera_image.frame?.sequence) this.take(message);
      }),
    );
    const timer = setInterval(() => this.updateValues(), VALUES_EVERY_MS);
    this.cleanups.push(() => clearInterval(timer));
  }

  /** Freezes the displayed frame, or resumes. */
  freeze(frozen: boolean): void {
    this.frozen.value = frozen;
    this.camera_image.freeze(frozen);
  }

  showZebra(shown: boolean): void {
    this.zebra.value = shown;
    this.camera_image.showZebra(shown);
  }

  toggleOrder(order: number): void {
    const { hidden_orders } = this.camera_image;
    if (!hidden_orders.delete(order)) hidden_orders.add(order);
    this.hidden.value = new Set(hidden_orders);
    this.camera_image.redraw();
    this.plot.redraw();
  }

  setLabels(words: PlotLabels): void {
    this.plot.setLabels(words);
  }

  dispose(): void {
    for (const end of this.cleanups) end();
    this.camera_image.dispose();
    this.plot.dispose();
    this.profiles.length = 0;
  }

  /** Shows the profile of a frame once its image is displayed. */
  private drawn(image: ImageMessage): void {
    this.rate.count(performance.now());
    this.rememberOrders(image);
    const profile = this.profiles.find(({ sequence }) => sequence === image.sequence);
    if (profile) this.showProfile(profile);
    else if (!image.calibrated) this.showProfile(undefined);
    // Draw in the same animation frame, so that the browser composites only once.
    this.plot.drawNow();
  }

  private take(profile: ProfileMessage): void {
    this.profiles.push(profile);
    if (this.profiles.length > KEPT_PROFILES) this.profiles.shift();
    // Show it now if its image is already displayed, or there are no images.
    const image = this.camera_image.frame;
    if (!image || image.sequence === profile.sequence) this.showProfile(profile);
  }

  private showProfile(profile: ProfileMessage | undefined): void {
    this.shown_profile = profile;
    this.has_profile.value = (profile?.x_mm.length ?? 0) > 0;
    this.plot.show(profile);
    if (this.pointed) this.follow(this.pointed);
  }

  private rememberOrders(image: ImageMessage): void {
    const known = this.orders.peek();
    const seen = new Set(known);
    for (const { order } of image.lines) seen.add(order);
    if (seen.size !== known.length) this.orders.value = inOrder(seen);
  }

  private point(pointed: Pointed | undefined): void {
    this.pointed = pointed;
    if (pointed) {
      this.follow(pointed);
      void this.updateReadout();
      return;
    }
    this.camera_image.mark(undefined);
    this.plot.mark(undefined);
    this.readout.value = undefined;
  }

  /** Marks the selected point in image and plot of the newest frame. */
  private follow(pointed: Pointed): void {
    if (pointed.in === "plot") {
      this.plot.mark(pointed.idx);
      this.camera_image.mark(this.imagePointOf(pointed.idx));
      return;
    }
    const at = this.lineAt(pointed);
    this.camera_image.mark(at);
    this.plot.mark(at && this.shown_profile ? profilePointAt(this.shown_profile, at) : undefined);
  }

  private lineAt(at: { u_px: number; v_px: number }) {
    const { frame: image, view } = this.camera_image;
    return image && nearestLinePoint(image, at, POINTER_RADIUS_PX / view.scale, this.camera_image.hidden_orders);
  }

  /** Image position of a profile point. */
  private imagePointOf(idx: number): { u_px: number; v_px: number } | undefined {
    const profile = this.shown_profile;
    const [u, v] = [profile?.pixels[2 * idx], profile?.pixels[2 * idx + 1]];
    if (!profile || u === undefined || v === undefined) return undefined;
    return { u_px: u / profile.units_per_px, v_px: v / profile.units_per_px };
  }

  /** Updates the readout at the pointer once the grey levels of the frame are decoded. */
  private async updateReadout(): Promise<void> {
    const image = this.camera_image.frame;
    const found = image && this.pointed && this.found(this.pointed);
    const greys = await this.camera_image.greys();
    // The pointer may have left in the meantime.
    if (!this.pointed) return;
    const grey = found && greys && greyAt(greys, image, found.u_px, found.v_px);
    this.readout.value = found && { ...found, grey };
  }

  private found(pointed: Pointed): Omit<Readout, "grey"> | undefined {
    const line = pointed.in === "image" ? this.lineAt(pointed) : undefined;
    const at = pointed.in === "plot" ? this.imagePointOf(pointed.idx) : pointed;
    if (!at) return undefined;
    const profile = this.profileOfImage();
    const idx = pointed.in === "plot" ? pointed.idx : line && profile ? profilePointAt(profile, line) : undefined;
    const order = line?.order ?? (idx !== undefined && profile ? orderOfPoint(profile, idx) : undefined);
    const { u_px, v_px } = line ?? at;
    return { u_px, v_px, order, point: pointOf(profile, idx) };
  }

  /** The profile of the displayed frame. */
  private profileOfImage(): ProfileMessage | undefined {
    const profile = this.shown_profile;
    const image = this.camera_image.frame;
    return !image || profile?.sequence === image.sequence ? profile : undefined;
  }

  private updateValues(): void {
    const image = this.camera_image.frame;
    if (!image) return;
    const now = performance.now();
    this.histogram.draw(image.histogram, image.n_saturated);
    this.values.value = {
      sequence: image.sequence,
      rate_hz: this.rate.rate_hz(now),
      age_ms: this.stream.ageOf(image.captured_ms),
      position_mm: image.position_mm,
      exposure_us: image.exposure_us,
      calibrated: image.calibrated,
      laser_on: image.laser_on,
      n_lines: image.lines.length,
      n_saturated: image.n_saturated,
      advice: adviceOf(image.histogram, image.n_saturated),
      skipped: this.camera_image.skipped,
      dropped: this.stream.dropped.peek(),
    };
    if (this.pointed) void this.updateReadout();
    if (this.ticks++ % QUALITY_EVERY === 0) void this.updateQuality(image);
  }

  private async updateQuality(image: ImageMessage): Promise<void> {
    const profile = this.profileOfImage();
    const greys = image.lines.length > 0 ? await this.camera_image.greys() : undefined;
    this.quality.value = qualityOf(image, profile, greys);
  }
}

/** Orders in ascending order, then lines without an order, so that the keys 1–5 are −2…+2. */
function inOrder(orders: Iterable<number>): number[] {
  const rank = (order: number) => (order === NO_ORDER ? Number.POSITIVE_INFINITY : order);
  return [...orders].sort((a, b) => rank(a) - rank(b));
}

function pointOf(profile: ProfileMessage | undefined, idx: number | undefined): Readout["point"] {
  if (!profile || idx === undefined) return undefined;
  const { x_mm, y_mm, z_mm, sigma_mm } = profile;
  const [x, y, z, sigma] = [x_mm[idx], y_mm[idx], z_mm[idx], sigma_mm[idx]];
  if (x === undefined || y === undefined || z === undefined || sigma === undefined) return undefined;
  return { x_mm: x, y_mm: y, z_mm: z, sigma_mm: sigma };
}
