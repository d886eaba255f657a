/** The cloud of an inspected part: places of its characteristics, and the deviation map of the current one. */

import { computed, effect, signal } from "@preact/signals";
import type { Schemas } from "../../api/client";
import type { App } from "../../app";
import {
  featureOnCloud,
  inverse,
  isInRegion,
  moved,
  type PlanFeature,
  type Pose,
  placeOf,
  shapeInPart,
} from "../../scene/cloud/fitted";
import type { Feature } from "../../scene/cloud/region";
import { featureDeviation } from "../../scene/cloud/region";
import type { Vec3 } from "../../scene/cloud/shapes";
import type { Label } from "../../scene/view/overlay";
import type { CloudViewer } from "../../scene/view/viewer";
import type { Inspection } from "../../state/records/inspections";
import { ResultState } from "../result/result_state";
import type { Scan } from "../result/scan_record";

type Plan = Schemas["Plan"];

/** Entries of a measure, the feature that is measured before those that it is measured from. */
const MEASURED_FIRST = ["of", "top", "surface", "to", "floor", "from"];

/** Where a characteristic is on the part: its feature, and the place of its label. */
interface Place {
  feature: string;
  at: Vec3;
}

export class PartState {
  readonly result: ResultState;
  /** The characteristic that is highlighted in the table and on the cloud. */
  readonly current = signal<string | undefined>(undefined);
  /** Ids of the features of each characteristic that have a place; the first is the measured one. */
  readonly places = computed(() => this.placed());
  private readonly part_from_frame: Pose | undefined;
  private readonly aligned_from: ReadonlySet<string>;
  private readonly on_cloud = new Map<string, Feature>();
  private viewer: CloudViewer | undefined;
  private end_feed: (() => void) | undefined;

  constructor(
    app: App,
    readonly inspection: Inspection,
    readonly plan: Plan,
    scan: Scan,
  ) {
    this.result = new ResultState(app, scan);
    const { frame, datum_from_part } = inspection;
    this.part_from_frame = frame === "datum" && datum_from_part ? inverse(datum_from_part) : undefined;
    this.aligned_from = featuresBelow(plan, plan.alignment);
  }

  /** Keeps labels and highlights up to date until the returned function is called. */
  follow(): () => void {
    const { view } = this.result;
    view.onLabel = (id) => this.show(id);
    const ends = [
      effect(() => {
        const current = this.current.value;
        view.labels.value = labelsOf(this.places.value, current);
      }),
      effect(() => {
        const picked = view.picks.value.at(-1)?.displayed.position_mm;
        const found = picked && this.characteristicAt(picked);
        if (found !== undefined) this.current.value = found;
      }),
    ];
    return () => {
      for (const end of ends) end();
      view.onLabel = undefined;
    };
  }

  onViewer(viewer: CloudViewer | undefined): void {
    this.end_feed?.();
    this.viewer = viewer;
    this.on_cloud.clear();
    this.end_feed = viewer && this.result.feed(viewer);
  }

  /** Called by its row: the cloud comes into view. */
  showFromRow(id: string): void {
    this.show(id);
    this.result.view.reveal();
  }

  /** Highlights a characteristic and colours the cloud by the distance from its feature. */
  show(id: string): void {
    this.current.value = id;
    const place = this.places.peek().get(id);
    const feature = place && this.featureOnCloud(place.feature);
    if (!feature || !place) return;
    const { view } = this.result;
    view.feature.value = feature;
    view.shape_name.value = place.feature;
    const { deviation: _, ...others } = view.custom_ranges.peek();
    view.custom_ranges.value = others;
    view.mode.value = "deviation";
  }

  private placed(): ReadonlyMap<string, Place> {
    const found = new Map<string, Place>();
    for (const { id, measure } of this.plan.characteristics) {
      const parts = new Map(Object.entries(measure));
      const in_order = [...MEASURED_FIRST.map((name) => parts.get(name)), measure];
      for (const feature of featuresIn(this.plan, in_order)) {
        const fitted = this.fitted(feature);
        const at = fitted && placeOf(fitted, this.part_from_frame);
        if (!at) continue;
        found.set(id, { feature, at });
        break;
      }
    }
    return found;
  }

  private fitted(id: string): PlanFeature | undefined {
    return this.inspection.features?.find((feature) => feature.id === id);
  }

  private featureOnCloud(id: string): Feature | undefined {
    const known = this.on_cloud.get(id);
    if (known) return known;
    const fitted = this.fitted(id);
    const shape = fitted && shapeInPart(fitted, this.part_from_frame);
    if (!shape || !this.viewer) return undefined;
    const feature = featureOnCloud(this.viewer.cloud, shape, fitted.rms_mm ?? 0, this.accepts(id));
    this.on_cloud.set(id, feature);
    return feature;
  }

  /** Whether a point of the part frame lies in the region in which a feature was searched. */
  private accepts(id: string): (at: Vec3) => boolean {
    const shape = this.plan.features.find((feature) => feature.id === id)?.shape;
    const region = shape && "select" in shape ? shape.select?.region : undefined;
    if (!region) return () => true;
    const pose = this.plan.alignment && !this.aligned_from.has(id) ? this.inspection.datum_from_part : undefined;
    return pose ? (at) => isInRegion(region, moved(pose, at)) : (at) => isInRegion(region, at);
  }

  /** The characteristic to whose feature a point of the cloud belongs. */
  private characteristicAt(at: Vec3): string | undefined {
    for (const [id, { feature }] of this.places.peek()) {
      const on_cloud = this.featureOnCloud(feature);
      if (on_cloud && Number.isFinite(featureDeviation(on_cloud, at))) return id;
    }
    return undefined;
  }
}

/** One label per feature, with the names of all characteristics that are measured on it. */
function labelsOf(places: ReadonlyMap<string, Place>, current: string | undefined): readonly Label[] {
  const labels = new Map<string, Label>();
  for (const [id, { feature, at }] of places) {
    const known = labels.get(feature) ?? { id, text: "", at, current: false };
    const text = known.text === "" ? id : `${known.text}, ${id}`;
    labels.set(feature, { ...known, text, current: known.current || id === current });
  }
  return [...labels.values()];
}

/** Ids of the features that a part of a plan names. */
function featuresIn({ features }: Plan, part: unknown): ReadonlySet<string> {
  const found = new Set<string>();
  const visit = (value: unknown) => {
    if (typeof value === "string" && features.some(({ id }) => id === value)) found.add(value);
    else if (typeof value === "object" && value !== null) Object.values(value).forEach(visit);
  };
  visit(part);
  return found;
}

/** Those and the features that they depend on. */
function featuresBelow(plan: Plan, part: unknown): ReadonlySet<string> {
  const found = new Set<string>();
  const visit = (id: string) => {
    if (found.has(id)) return;
    found.add(id);
    for (const other of featuresIn(plan, plan.features.find((feature) => feature.id === id)?.shape)) visit(other);
  };
  for (const id of featuresIn(plan, part)) visit(id);
  return found;
}
