/** Two scans in one coordinate frame: side by side, or the second as its distance from the first. */

import { effect, signal } from "@preact/signals";
import type { App } from "../../app";
import { HeightMap } from "../../scene/cloud/height_map";
import type { CloudViewer } from "../../scene/view/viewer";
import { ResultState } from "../result/result_state";
import type { Scan } from "../result/scan_record";

/** Delay from the last points until the surface is computed, ms. */
const COMPLETE_AFTER_MS = 500;

export class CompareState {
  readonly results: readonly [ResultState, ResultState];
  /** The surface of the first scan. */
  readonly surface = signal<HeightMap | undefined>(undefined);
  private readonly viewers: [CloudViewer | undefined, CloudViewer | undefined] = [undefined, undefined];
  private readonly end_feeds: ((() => void) | undefined)[] = [];

  constructor(app: App, first: Scan, second: Scan) {
    this.results = [new ResultState(app, first), new ResultState(app, second)];
    const [one, other] = this.results;
    one.view.onMoved = () => this.together(0);
    other.view.onMoved = () => this.together(1);
  }

  /** Keeps both views together until the returned function is called; the second has the tools. */
  follow(): () => void {
    const [first, second] = this.results;
    let timer: ReturnType<typeof setTimeout> | undefined;
    const ends = [
      first.view.mirror(second.view),
      // The first cloud is complete when no more points arrive.
      effect(() => {
        if (first.view.n_points.value === 0) return;
        clearTimeout(timer);
        timer = setTimeout(() => this.computeSurface(), COMPLETE_AFTER_MS);
      }),
    ];
    return () => {
      clearTimeout(timer);
      for (const end of ends) end();
    };
  }

  /** Called with the viewer of the first (0) or second (1) scan. */
  onViewer(which: 0 | 1, viewer: CloudViewer | undefined): void {
    this.end_feeds[which]?.();
    this.viewers[which] = viewer;
    this.end_feeds[which] = viewer && this.results[which].feed(viewer);
  }

  /** Colours the second scan by its distance from the first, or by its own values. */
  showDifference(shown: boolean): void {
    const [first, second] = this.results;
    const map = this.surface.value;
    second.view.feature.value = shown && map ? { shape: { kind: "surface", map } } : undefined;
    second.view.shape_name.value = first.scan.name;
    if (shown && map) second.view.mode.value = "deviation";
    else if (second.view.mode.peek() === "deviation") second.view.mode.value = "height";
  }

  private computeSurface(): void {
    const cloud = this.viewers[0]?.cloud;
    if (cloud && cloud.n_points > 0) this.surface.value = new HeightMap(cloud);
  }

  private together(moved: 0 | 1): void {
    const [by, other] = [this.viewers[moved], this.viewers[1 - moved]];
    if (by && other) other.follow(by);
  }
}
