/** Display settings and picked points of a point cloud, as signals applied to the viewer. */

import { computed, effect, type Signal, signal } from "@preact/signals";
import type { Box } from "../../scene/cloud/cloud";
import { type CutProfile, cutProfile, middleCut } from "../../scene/cloud/cut";
import type { ExactPoint } from "../../scene/cloud/exact_point";
import type { Mesh } from "../../scene/cloud/glb";
import { countShown, proposedRange, sampleValues } from "../../scene/cloud/histogram";
import type { Picked } from "../../scene/cloud/picking";
import type { Feature } from "../../scene/cloud/region";
import type { Vec3 } from "../../scene/cloud/shapes";
import { AXES, AXIS_NAMES, type Axis, type Cut, countIn } from "../../scene/cloud/space";
import { COLOUR_MODES, type ColourMode, type ValueMode, type ValueRange } from "../../scene/colours";
import type { Label } from "../../scene/view/overlay";
import type { CloudViewer } from "../../scene/view/viewer";
import { remembered } from "../../state/browser/remembered";
import { language } from "../../text";
import { decimal } from "../../units";

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

/** Whether surfaces are shaded. */
const shaded = remembered("cloud_shaded", true);

/** Whether z points upwards. */
const z_up = remembered("cloud_z_up", false);

/** Card of a tool. */
export type ViewerCard = "region" | "cut";

const remembered_mode = remembered<ColourMode>("cloud_mode", "order", COLOUR_MODES);

/** The dimensions of a box along x, y and z. */
function dimensionsOf({ min, max }: Box): readonly string[] {
  return AXES.map((axis) => `${AXIS_NAMES[axis]} ${decimal(max[axis] - min[axis], 2, language.value)} mm`);
}

/** What a second view takes over from the first one. */
const COMMON = ["mode", "hide_outside", "custom_ranges", "shaded", "region", "crop", "cut", "dimensions"] as const;

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
  readonly shaded = shaded;
  readonly z_up = z_up;
  /** Whether the bounding box is shown with its dimensions. */
  readonly dimensions = signal(false);
  /** Whether the view fills the window. */
  readonly full = signal(false);
  readonly card = signal<ViewerCard | undefined>(undefined);
  /** Whether drags select a region. */
  readonly selecting = signal(false);
  /** The region of the tools, part frame, mm. */
  readonly region = signal<Box | undefined>(undefined);
  /** Whether the last selection contained no points. */
  readonly empty_selection = signal(false);
  /** Whether points outside the region are hidden. */
  readonly crop = signal(false);
  readonly n_region = computed(() => {
    this.n_points.value;
    const region = this.region.value;
    return region && this.viewer ? countIn(this.viewer.cloud, region) : undefined;
  });
  readonly cut = signal<Cut | undefined>(undefined);
  readonly cut_profile = computed<CutProfile | undefined>(() => {
    this.n_points.value;
    const cut = this.cut.value;
    if (!cut || !this.viewer) return undefined;
    return cutProfile(this.viewer.cloud, cut, { crop: this.crop.value ? this.region.value : undefined, cut });
  });
  /** Points picked in the cut: up to two. */
  readonly cut_picks = signal<readonly Vec3[]>([]);
  /** Labelled places of the cloud. */
  readonly labels = signal<readonly Label[]>([]);
  readonly picks = signal<readonly PickedPoint[]>([]);
  /** Ranges entered by the user; otherwise the automatic range applies. */
  readonly custom_ranges = signal<Partial<Record<ValueMode, ValueRange>>>({});
  /** Sorted sample of the values of the mode. */
  readonly values = signal<Float32Array>(new Float32Array());
  readonly range = computed<ValueRange>(() => {
    const mode = this.mode.value;
    if (mode === "order") return { low: 0, high: 1 };
    const custom = this.custom_ranges.value[mode];
    const half_range = mode === "deviation" ? this.feature.value?.half_range_um : undefined;
    if (custom || half_range === undefined) return custom ?? proposedRange(this.values.value, mode);
    return { low: -half_range, high: half_range };
  });
  /** Called with the id of a label that was clicked. */
  onLabel: ((id: string) => void) | undefined;
  /** Called when the user has moved the view. */
  onMoved: (() => void) | undefined;
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
      effect(() => {
        const picks = this.picks.value.map(positionOf);
        viewer.mark(picks.length > 0 ? picks : this.cut_picks.value);
      }),
      effect(() => viewer.label(this.labels.value)),
      effect(() => viewer.shade(this.shaded.value)),
      effect(() => viewer.select(this.selecting.value)),
      effect(() => viewer.turnZ(this.z_up.value)),
      effect(() => {
        this.n_points.value;
        const region = this.card.value === "region" || this.crop.value ? this.region.value : undefined;
        const box = region ?? (this.dimensions.value ? viewer.cloud.box : undefined);
        const shown = this.dimensions.value ? box : undefined;
        viewer.outline(box, shown ? dimensionsOf(shown) : []);
      }),
      effect(() => viewer.limit({ crop: this.crop.value ? this.region.value : undefined, cut: this.cut.value })),
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

  /** Scrolls the page so that the cloud is in view. */
  reveal(): void {
    this.viewer?.reveal();
  }

  /** Selects the displayed points in the view as region. */
  selectView(): void {
    this.viewer?.selectRegion();
  }

  /** Called with the selected region, undefined if it contains no points. */
  regionSelected(region: Box | undefined): void {
    this.empty_selection.value = region === undefined;
    if (region) this.region.value = region;
    this.selecting.value = false;
    this.card.value = "region";
  }

  clearRegion(): void {
    this.region.value = undefined;
    this.crop.value = false;
    this.selecting.value = false;
    this.empty_selection.value = false;
  }

  /** Cuts through the middle of the region or of the cloud. */
  cutThrough(axis: Axis): void {
    const box = (this.crop.peek() ? this.region.peek() : undefined) ?? this.viewer?.cloud.box;
    this.cut_picks.value = [];
    if (box) this.cut.value = middleCut(box, axis, this.cut.peek());
  }

  clearCut(): void {
    this.cut.value = undefined;
    this.cut_picks.value = [];
  }

  /** Extent of the cloud along an axis. */
  extent(axis: Axis): readonly [number, number] {
    const box = this.viewer?.cloud.box;
    return box ? [box.min[axis], box.max[axis]] : [0, 1];
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

  /** Displays what another view displays, as it displays it, until the returned function is called. */
  mirror(first: ViewState): () => void {
    return effect(() => {
      for (const name of COMMON) (this[name] as Signal).value = first[name].value;
      const mode = first.mode.value;
      if (mode !== "order") this.custom_ranges.value = { [mode]: first.range.value };
    });
  }

  /** Colours the cloud by the distance from a feature. */
  showDeviation(feature: Feature, name: string): void {
    this.deviateFrom(feature, name);
    this.mode.value = "deviation";
  }

  /** Sets the feature from which deviations are computed. */
  deviateFrom(feature: Feature, name: string): void {
    this.feature.value = feature;
    this.shape_name.value = name;
    // A range entered for another shape does not apply.
    const { deviation: _, ...others } = this.custom_ranges.peek();
    this.custom_ranges.value = others;
  }

  private sample(): void {
    const mode = this.mode.peek();
    if (!this.viewer || mode === "order") return;
    this.sampled_at_ms = performance.now();
    this.values.value = sampleValues(this.viewer.cloud, mode, this.feature.peek());
  }
}
