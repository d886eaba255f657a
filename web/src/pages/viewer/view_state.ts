/** Display settings and picked points of a point cloud, as signals applied to the viewer. */

import { computed, effect, type Signal, signal } from "@preact/signals";
import type { ExactPoint } from "../../scene/cloud/exact_point";
import type { Mesh } from "../../scene/cloud/glb";
import { countShown, proposedRange, sampleValues } from "../../scene/cloud/histogram";
import type { Picked } from "../../scene/cloud/picking";
import type { Feature } from "../../scene/cloud/region";
import type { Vec3 } from "../../scene/cloud/shapes";
import type { ColourMode, ValueMode, ValueRange } from "../../scene/colours";
import type { CloudViewer } from "../../scene/view/viewer";
import { remembered } from "../../state/browser/remembered";

/** Update interval of the histogram while the cloud grows, ms. */
const SAMPLE_EVERY_MS = 1000;

/** A picked point: first as displayed, then with the exact values from the server. */
export interface PickedPoint {
  displayed: Picked;
  exact: ExactPoint | undefined;
  state: "asking" | "exact" | "displayed";
}

export const positionOf = (point: PickedPoint): Vec3 => point.exact?.position_mm ?? point.displayed.position_mm;

export type QueryExact = (picked: Picked) => Promise<ExactPoint | undefined>;

const remembered_mode = remembered<ColourMode>("cloud_mode", "order");

export class ViewState {
  readonly mode: Signal<ColourMode> = signal(remembered_mode.peek());
  readonly hide_outside = signal(false);
  readonly orthographic = signal(false);
  readonly lost = signal(false);
  readonly n_points = signal(0);
  /** Number of visible points; undefined if all are visible. */
  readonly n_shown = computed<number | undefined>(() => {
    // Recompute whenever the histogram is updated.
    this.values.value;
    const [mode, range] = [this.mode.value, this.range.value];
    if (!this.hide_outside.value || mode === "order" || !this.viewer) return undefined;
    return countShown(this.viewer.cloud, mode, this.feature.value, range);
  });
  readonly feature = signal<Feature | undefined>(undefined);
  readonly shape_name = signal("");
  readonly mesh = signal<Mesh | undefined>(undefined);
  readonly shown = signal<"cloud" | "mesh" | "both">("cloud");
  readonly picks = signal<readonly PickedPoint[]>([]);
  /** Ranges entered by the user; otherwise the automatic range applies. */
  readonly custom_ranges = signal<Partial<Record<ValueMode, ValueRange>>>({});
  /** Sorted sample of the values of the mode. */
  readonly values = signal<Float32Array>(new Float32Array());
  readonly range = computed<ValueRange>(() => {
    const mode = this.mode.value;
    if (mode === "order") return { low: 0, high: 1 };
    return this.custom_ranges.value[mode] ?? proposedRange(this.values.value, mode);
  });
  private viewer: CloudViewer | undefined;
  private sampled_at_ms = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly queryExact: QueryExact) {}

  /** Follows a viewer until the returned function is called. */
  attach(viewer: CloudViewer): () => void {
    this.viewer = viewer;
    const ends = [
      effect(() => {
        remembered_mode.value = this.mode.value;
        this.feature.value;
        this.sample();
      }),
      effect(() =>
        viewer.colour({
          mode: this.mode.value,
          range: this.range.value,
          hide_outside: this.hide_outside.value,
        }),
      ),
      effect(() => viewer.deviateFrom(this.feature.value)),
      effect(() => viewer.setMesh(this.mesh.value)),
      effect(() => {
        const shown = this.mesh.value ? this.shown.value : "cloud";
        viewer.show({ cloud: shown !== "mesh", mesh: shown !== "cloud" });
      }),
      effect(() => viewer.mark(this.picks.value.map(positionOf))),
    ];
    return () => {
      for (const end of ends) end();
      clearTimeout(this.timer);
      this.timer = undefined;
      this.viewer = undefined;
    };
  }

  /** Called when points were added; updates the histogram at a limited rate. */
  pointsAdded(n_points: number): void {
    this.n_points.value = n_points;
    if (n_points === 0) this.picks.value = [];
    if (this.timer !== undefined) return;
    const due_ms = Math.max(0, this.sampled_at_ms + SAMPLE_EVERY_MS - performance.now());
    this.timer = setTimeout(() => {
      this.timer = undefined;
      this.sample();
    }, due_ms);
  }

  /** Picks a point and requests its exact values; a third pick starts a new pair. */
  async pick(displayed: Picked): Promise<void> {
    const asked: PickedPoint = { displayed, exact: undefined, state: "asking" };
    const before = this.picks.peek();
    this.picks.value = before.length >= 2 ? [asked] : [...before, asked];
    const exact = await this.queryExact(displayed).catch(() => undefined);
    const answered: PickedPoint = { displayed, exact, state: exact ? "exact" : "displayed" };
    this.picks.value = this.picks.peek().map((point) => (point === asked ? answered : point));
  }

  clearPicks(): void {
    this.picks.value = [];
  }

  setRange(range: ValueRange | undefined): void {
    const mode = this.mode.peek();
    if (mode === "order") return;
    const { [mode]: _, ...others } = this.custom_ranges.peek();
    this.custom_ranges.value = range ? { ...others, [mode]: range } : others;
  }

  private sample(): void {
    const mode = this.mode.peek();
    if (!this.viewer || mode === "order") return;
    this.sampled_at_ms = performance.now();
    this.values.value = sampleValues(this.viewer.cloud, mode, this.feature.peek());
  }
}
