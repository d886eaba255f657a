/**
 * Draws the point cloud of a scan while it grows, and its mesh. Draws only after changes.
 *
 * Blocks are queued and written within a time budget per frame, so that a burst of points does not block the page.
 * All GPU data have a copy in memory, from which they are restored after a loss of the WebGL context.
 */

import type { PointsBlock } from "../../stream/protocol";
import { type Box, Cloud, type CloudChunk, LANES } from "../cloud/cloud";
import type { Mesh } from "../cloud/glb";
import { isHidden, valueAt } from "../cloud/histogram";
import { type Picked, pick } from "../cloud/picking";
import type { Feature } from "../cloud/region";
import { type Rectangle, regionIn } from "../cloud/region_pick";
import { dot, type Vec3 } from "../cloud/shapes";
import { type DisplayedSpace, isDisplayed, WHOLE_SPACE } from "../cloud/space";
import { type Colouring, rgb } from "../colours";
import { CloudLayer } from "../gpu/cloud_layer";
import { MeshLayer } from "../gpu/mesh_layer";
import { ShadingPass } from "../gpu/shading_pass";
import { colourUniforms, featureUniforms, initialUniforms, spaceUniforms } from "../gpu/uniforms";
import { Controls } from "./controls";
import { Orbit, type ViewName } from "./orbit";
import { type Label, Overlay } from "./overlay";
import { Thinning } from "./thinning";

/** Time per frame for writing points, of about 8 ms in total. */
const WRITE_BUDGET_MS = 2;

/** Time without movement or new points after which the cloud is drawn completely. */
const REST_AFTER_MS = 180;

/** Background colour, that of `--data-ground`. */
const BACKGROUND = rgb("#14171a");

/** Point size, mm. */
const POINT_SIZE_MM = 0.22;

/** Number of frame times kept. */
const KEPT_FRAME_TIMES = 4096;

export interface ViewerEvents {
  /** Points were added, or the view was cleared. */
  onGrown?: (cloud: Cloud) => void;
  onPicked?: (picked: Picked) => void;
  /** The user clears the picked points. */
  onCleared?: () => void;
  onProjection?: (orthographic: boolean) => void;
  /** A region of the view was selected; undefined: it contains no points. */
  onRegion?: (region: Box | undefined) => void;
  /** A label was clicked. */
  onLabel?: (id: string) => void;
  /** The view was moved by the user. */
  onMoved?: () => void;
  /** The WebGL context was lost or restored. */
  onContext?: (lost: boolean) => void;
}

export interface ViewerStatistics {
  n_points: number;
  n_drawn: number;
  n_waiting_blocks: number;
  /** Points uploaded to the GPU; recolouring uploads none. */
  n_uploaded: number;
  thinning: number;
  /** Script time of the latest frames, ms. */
  frame_ms: readonly number[];
}

export class CloudViewer {
  readonly canvas: HTMLCanvasElement;
  cloud = new Cloud();
  readonly orbit = new Orbit();
  private readonly gl: WebGL2RenderingContext;
  private readonly uniforms = initialUniforms();
  private readonly overlay: Overlay;
  private readonly controls: Controls;
  private readonly resize_observer: ResizeObserver;
  private readonly thinning = new Thinning(LANES);
  private layer: CloudLayer;
  private mesh: MeshLayer | undefined;
  private waiting: PointsBlock[] = [];
  private marks: readonly Vec3[] = [];
  private labels: readonly Label[] = [];
  private region: Box | undefined;
  private dimensions: readonly string[] = [];
  private selection: Rectangle | undefined;
  private space: DisplayedSpace = WHOLE_SPACE;
  /** Undefined if shading is off or not possible. */
  private shading: ShadingPass | undefined;
  private shaded = false;
  private colouring: Colouring | undefined;
  private feature: Feature | undefined;
  private shown = { cloud: true, mesh: false };
  /** Whether points, mesh or view have changed since they were drawn; otherwise what lies over them is drawn alone. */
  private stale = true;
  private frame = 0;
  private last_frame_ms = 0;
  private active_until_ms = 0;
  private rest_timer: ReturnType<typeof setTimeout> | undefined;
  private n_drawn = 0;
  private frame_ms: number[] = [];
  /** Whether the user has moved the view; otherwise it follows the growing cloud. */
  private moved_by_user = false;
  private lost = false;

  /** Adds a canvas to `host`. Throws if the browser does not support WebGL 2. */
  constructor(
    private readonly host: HTMLElement,
    private readonly events: ViewerEvents = {},
  ) {
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    const gl = this.canvas.getContext("webgl2", { antialias: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("no WebGL 2");
    this.gl = gl;
    this.layer = new CloudLayer(gl);
    host.append(this.canvas);
    this.overlay = new Overlay(host, (id) => events.onLabel?.(id));
    this.controls = new Controls(this.canvas, this.orbit, {
      moved: () => this.moved(),
      picked: (x_px, y_px) => this.pickAt(x_px, y_px),
      fit: () => this.fit(),
      view: (name) => this.view(name),
      toggleOrthographic: () => this.toggleOrthographic(),
      clear: () => events.onCleared?.(),
      selecting: (rectangle) => {
        this.selection = rectangle;
        this.requestFrame();
      },
      selected: (rectangle) => this.selectRegion(rectangle),
    });
    this.canvas.addEventListener("webglcontextlost", this.contextLost);
    this.canvas.addEventListener("webglcontextrestored", this.contextRestored);
    this.resize_observer = new ResizeObserver(() => this.resize());
    this.resize_observer.observe(host);
    this.resize();
  }

  /** Adds a block of points, which is drawn in one of the next frames. */
  append(block: PointsBlock): void {
    this.waiting.push(block);
    this.active();
    if (document.hidden) this.write(Number.POSITIVE_INFINITY);
  }

  /** Clears all points, mesh and marks. */
  clear(): void {
    this.layer.dispose();
    this.layer = new CloudLayer(this.gl);
    this.prepareLayer();
    this.cloud = new Cloud();
    this.waiting = [];
    this.marks = [];
    this.labels = [];
    this.moved_by_user = false;
    this.setMesh(undefined);
    this.events.onGrown?.(this.cloud);
    this.invalidate();
  }

  colour(colouring: Colouring): void {
    this.colouring = colouring;
    Object.assign(this.uniforms, colourUniforms(colouring));
    this.invalidate();
  }

  /** Sets the feature from which deviations are computed. */
  deviateFrom(feature: Feature | undefined): void {
    this.feature = feature;
    Object.assign(this.uniforms, featureUniforms(feature));
    this.prepareLayer();
    this.invalidate();
  }

  private prepareLayer(): void {
    const { feature } = this;
    this.layer.setRegion(feature?.grid);
    this.layer.setSurface(feature?.shape.kind === "surface" ? feature.shape.map : undefined);
    this.layer.setDeviations(feature?.shape.kind === "model" ? feature.shape.map : undefined);
  }

  setMesh(mesh: Mesh | undefined): void {
    this.mesh?.dispose();
    this.mesh = mesh && new MeshLayer(this.gl, mesh);
    this.invalidate();
  }

  show(shown: { cloud: boolean; mesh: boolean }): void {
    this.shown = shown;
    this.invalidate();
  }

  /** Marks picked points. */
  mark(marks: readonly Vec3[]): void {
    this.marks = marks;
    this.requestFrame();
  }

  /** Labels places of the cloud. */
  label(labels: readonly Label[]): void {
    this.labels = labels;
    this.requestFrame();
  }

  /** Outlines a box with its dimensions along x, y and z. */
  outline(region: Box | undefined, dimensions: readonly string[] = []): void {
    this.region = region;
    this.dimensions = dimensions;
    this.requestFrame();
  }

  /** Displays only a part of space. */
  limit(space: DisplayedSpace): void {
    this.space = space;
    Object.assign(this.uniforms, spaceUniforms(space));
    this.invalidate();
  }

  /** Whether the surface is shaded; ignored if the browser cannot do it. */
  shade(shaded: boolean): void {
    this.shaded = shaded;
    if (shaded) this.shading ??= ShadingPass.create(this.gl);
    this.invalidate();
  }

  /** Whether drags select a region. */
  select(selects: boolean): void {
    this.controls.selects = selects;
    this.canvas.classList.toggle("selects", selects);
  }

  /** Selects the displayed points within a rectangle, all of the view by default. */
  selectRegion(rectangle?: Rectangle): void {
    const { clientWidth: width_px, clientHeight: height_px } = this.canvas;
    const whole = { left_px: 0, top_px: 0, right_px: width_px, bottom_px: height_px };
    const displayed = (at: Vec3) => isDisplayed(this.space, at);
    const size = { width_px, height_px };
    this.events.onRegion?.(regionIn(this.cloud, this.orbit.clip(), rectangle ?? whole, size, displayed));
  }

  /** Shows what another view shows, and is moved by it. */
  follow(other: CloudViewer): void {
    const { target, azimuth_rad, elevation_rad, distance_mm, orthographic, z_up } = other.orbit;
    Object.assign(this.orbit, { target, azimuth_rad, elevation_rad, distance_mm, orthographic, z_up });
    this.moved_by_user = true;
    this.active();
  }

  /** Scrolls the page so that the cloud is in view. */
  reveal(): void {
    this.host.scrollIntoView({ block: "nearest" });
  }

  view(name: ViewName): void {
    this.orbit.view(name);
    this.fit();
  }

  fit(): void {
    if (this.cloud.box) this.orbit.fit(this.cloud.box);
    this.moved_by_user = false;
    this.active();
  }

  /** Whether z points upwards. */
  turnZ(z_up: boolean): void {
    if (this.orbit.z_up === z_up) return;
    this.orbit.z_up = z_up;
    this.invalidate();
  }

  toggleOrthographic(): void {
    this.orbit.orthographic = !this.orbit.orthographic;
    this.events.onProjection?.(this.orbit.orthographic);
    this.invalidate();
  }

  /** Picks the point at a position of the canvas, CSS pixels. */
  pickAt(x_px: number, y_px: number): void {
    if (!this.shown.cloud) return;
    const { clientWidth: width_px, clientHeight: height_px } = this.canvas;
    const picked = pick(this.cloud, this.orbit.clip(), { x_px, y_px, width_px, height_px }, this.hides());
    if (picked) this.events.onPicked?.(picked);
  }

  /** Test for hidden points; undefined if all are visible. */
  private hides(): ((chunk: CloudChunk, point: number) => boolean) | undefined {
    const { colouring, feature, space } = this;
    const by_value = colouring?.hide_outside && colouring.mode !== "order";
    if (!by_value && !space.crop && !space.cut) return undefined;
    return (chunk, point) => {
      const at = chunk.position(point);
      if (!isDisplayed(space, at)) return true;
      if (!by_value || colouring.mode === "order") return false;
      return isHidden(
        valueAt(colouring.mode, at, chunk.attributes(point), feature),
        colouring.mode,
        colouring.range,
      );
    };
  }

  /** The current view with its scale as the data URL of a PNG; undefined while the context is lost. */
  snapshot(): string | undefined {
    if (this.lost) return undefined;
    // The content of the canvas is available only until the browser has composited it.
    this.stale = true;
    this.render();
    const { clientWidth: width_px, clientHeight: height_px, width, height } = this.canvas;
    const image = document.createElement("canvas");
    [image.width, image.height] = [width, height];
    const context = image.getContext("2d");
    if (!context || width_px === 0) return undefined;
    context.drawImage(this.canvas, 0, 0);
    context.scale(width / width_px, height / height_px);
    this.overlay.paint(context, this.orbit, width_px, height_px);
    return image.toDataURL("image/png");
  }

  statistics(): ViewerStatistics {
    return {
      n_points: this.cloud.n_points,
      n_drawn: this.n_drawn,
      n_waiting_blocks: this.waiting.length,
      n_uploaded: this.layer.n_uploaded,
      thinning: this.thinning.factor,
      frame_ms: this.frame_ms,
    };
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    clearTimeout(this.rest_timer);
    this.resize_observer.disconnect();
    this.controls.dispose();
    this.overlay.dispose();
    this.layer.dispose();
    this.mesh?.dispose();
    this.shading?.dispose();
    this.canvas.removeEventListener("webglcontextlost", this.contextLost);
    this.canvas.removeEventListener("webglcontextrestored", this.contextRestored);
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
    this.canvas.remove();
  }

  private moved(): void {
    this.moved_by_user = true;
    this.events.onMoved?.();
    this.active();
  }

  /** Called on movement or growth: points are thinned until the view is at rest. */
  private active(): void {
    const now = performance.now();
    if (now > this.active_until_ms) this.thinning.begin(this.cloud.n_points);
    this.active_until_ms = now + REST_AFTER_MS;
    clearTimeout(this.rest_timer);
    this.rest_timer = setTimeout(() => this.rest(), REST_AFTER_MS);
    this.invalidate();
  }

  private rest(): void {
    if (this.waiting.length > 0) {
      this.active();
      return;
    }
    const thinned = this.thinning.factor > 1;
    this.thinning.rest();
    if (thinned) this.invalidate();
  }

  private invalidate(): void {
    this.stale = true;
    this.requestFrame();
  }

  /** Marks, labels, outline and selection are drawn again, and the points only if they are stale. */
  private requestFrame(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame((now) => this.draw(now));
  }

  private draw(now: number): void {
    const began = performance.now();
    this.frame = 0;
    const since_last_ms = now - this.last_frame_ms;
    this.last_frame_ms = now;
    // Longer intervals are idle times, not slow frames.
    if (now < this.active_until_ms && since_last_ms < 2 * REST_AFTER_MS) this.thinning.frame(since_last_ms);
    this.write(began + WRITE_BUDGET_MS);
    if (!this.lost) this.render();
    if (this.waiting.length > 0) this.invalidate();
    this.recordFrameTime(performance.now() - began);
  }

  private render(): void {
    const { clientWidth: width_px, clientHeight: height_px } = this.canvas;
    // Hidden, for example in print: nothing to draw.
    if (width_px === 0 || height_px === 0) return;
    const clip = this.orbit.clip();
    if (this.stale) this.renderScene(clip);
    const { marks, labels, region, dimensions, selection } = this;
    this.overlay.draw(this.orbit, clip, { marks, labels, region, dimensions, selection }, width_px, height_px);
  }

  /** Draws points and mesh. */
  private renderScene(clip: number[]): void {
    const { gl, uniforms } = this;
    const px_per_mm = this.canvas.height / 2 / this.orbit.half_height_mm;
    const least_px = 1.5 * pixelRatio();
    const size_px = Math.min(12, Math.max(least_px, POINT_SIZE_MM * px_per_mm));
    Object.assign(uniforms, {
      u_clip: clip,
      u_size_px: size_px,
      // The depth jitter of overlapping points exceeds their difference in depth.
      u_shuffle_mm: (2 * size_px) / px_per_mm,
      u_towards: this.orbit.basis().back,
    });
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    const shading = this.shaded ? this.shading : undefined;
    gl.clearColor(...BACKGROUND, 1);
    if (shading) shading.begin(BACKGROUND);
    else gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.layer.bindMaps();
    if (this.shown.mesh) this.mesh?.draw(uniforms);
    this.layer.write(this.cloud);
    this.n_drawn = this.shown.cloud ? this.layer.draw(uniforms, this.thinning.factor) : 0;
    const { target, distance_mm, orthographic } = this.orbit;
    shading?.end({
      mm_per_px: 1 / px_per_mm,
      target_mm: -dot(target, this.orbit.basis().back),
      eye_mm: orthographic ? 0 : distance_mm,
      reach_px: Math.max(1, Math.round(size_px)),
    });
    this.stale = false;
    this.canvas.dataset.points = String(this.cloud.n_points);
    this.canvas.dataset.drawn = String(this.n_drawn);
    this.canvas.dataset.uploaded = String(this.layer.n_uploaded);
  }

  /** Writes queued blocks until a time. */
  private write(until_ms: number): void {
    let n_written = 0;
    for (const block of this.waiting) {
      this.cloud.append(block);
      n_written += 1;
      if (performance.now() > until_ms) break;
    }
    if (n_written === 0) return;
    this.waiting = this.waiting.slice(n_written);
    this.stale = true;
    if (!this.moved_by_user && this.cloud.box) this.orbit.fit(this.cloud.box);
    this.events.onGrown?.(this.cloud);
  }

  private recordFrameTime(frame_ms: number): void {
    this.frame_ms.push(frame_ms);
    if (this.frame_ms.length > KEPT_FRAME_TIMES) this.frame_ms.shift();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.host;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.canvas.width = Math.floor(clientWidth * pixelRatio());
    this.canvas.height = Math.floor(clientHeight * pixelRatio());
    this.orbit.resize(clientWidth / clientHeight);
    if (!this.moved_by_user && this.cloud.box) this.orbit.fit(this.cloud.box);
    this.invalidate();
  }

  private readonly contextLost = (event: Event): void => {
    // Without this the browser does not restore the context.
    event.preventDefault();
    this.lost = true;
    this.events.onContext?.(true);
  };

  private readonly contextRestored = (): void => {
    this.lost = false;
    this.layer.restore();
    this.shading = this.shaded ? ShadingPass.create(this.gl) : undefined;
    this.setMesh(this.mesh?.mesh);
    this.events.onContext?.(false);
    this.invalidate();
  };
}

/** Canvas pixels per CSS pixel. */
function pixelRatio(): number {
  return Math.min(2, devicePixelRatio);
}
