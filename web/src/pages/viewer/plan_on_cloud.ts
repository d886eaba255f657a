/** The evaluated features of a plan on the displayed cloud: places of characteristics, points of features. */

import type { Schemas } from "../../api/client";
import type { Cloud } from "../../scene/cloud/cloud";
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
import { type Feature, featureDeviation } from "../../scene/cloud/region";
import type { Vec3 } from "../../scene/cloud/shapes";
import type { Label } from "../../scene/view/overlay";
import type { ViewState } from "./view_state";

type Plan = Schemas["Plan"];

/** Entries of a measure, the feature that is measured before those that it is measured from. */
const MEASURED_FIRST = ["of", "top", "surface", "to", "floor", "from"];

/** What an inspection, or the trial of a plan, says about features. */
export type EvaluatedFeatures = Pick<Schemas["InspectionDto"], "frame" | "datum_from_part" | "features">;

/** Where a characteristic is on the part: its feature, and the place of its label. */
interface Place {
  feature: string;
  at: Vec3;
}

export class PlanOnCloud {
  /** Ids of the characteristics that have a place. */
  readonly places: ReadonlyMap<string, Place>;
  private readonly part_from_frame: Pose | undefined;
  private readonly aligned_from: ReadonlySet<string>;
  private readonly on_cloud = new Map<string, { feature: Feature; n_points: number }>();

  constructor(
    private readonly plan: Plan,
    private readonly evaluated: EvaluatedFeatures,
    /** The displayed cloud; undefined while there is none. */
    private readonly cloud: () => Cloud | undefined,
  ) {
    const { frame, datum_from_part } = evaluated;
    this.part_from_frame = frame === "datum" && datum_from_part ? inverse(datum_from_part) : undefined;
    this.aligned_from = featuresBelow(plan, plan.alignment);
    this.places = this.placed();
  }

  /** One label per feature, with the names of all characteristics that are measured on it. */
  labels(current: string | undefined): readonly Label[] {
    const labels = new Map<string, Label>();
    for (const [id, { feature, at }] of this.places) {
      const known = labels.get(feature) ?? { id, text: "", at, current: false };
      const text = known.text === "" ? id : `${known.text}, ${id}`;
      labels.set(feature, { ...known, text, current: known.current || id === current });
    }
    return [...labels.values()];
  }

  /** Colours a view by the distance from the feature of a characteristic, if it has one. */
  show(id: string, view: ViewState): void {
    const place = this.places.get(id);
    const feature = place && this.featureOnCloud(place.feature);
    if (feature) view.showDeviation(feature, place.feature);
  }

  /** The characteristic to whose feature a point of the cloud belongs. */
  characteristicAt(at: Vec3): string | undefined {
    for (const [id, { feature }] of this.places) {
      const on_cloud = this.featureOnCloud(feature);
      if (on_cloud && Number.isFinite(featureDeviation(on_cloud, at))) return id;
    }
    return undefined;
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
    return this.evaluated.features?.find((feature) => feature.id === id);
  }

  private featureOnCloud(id: string): Feature | undefined {
    const cloud = this.cloud();
    if (!cloud) return undefined;
    const known = this.on_cloud.get(id);
    // A cloud that is still being loaded has more points later.
    if (known?.n_points === cloud.n_points) return known.feature;
    const fitted = this.fitted(id);
    const shape = fitted && shapeInPart(fitted, this.part_from_frame);
    if (!shape) return undefined;
    const feature = featureOnCloud(cloud, shape, fitted.rms_mm ?? 0, this.accepts(id));
    this.on_cloud.set(id, { feature, n_points: cloud.n_points });
    return feature;
  }

  /** Whether a point of the part frame lies in the region in which a feature was searched. */
  private accepts(id: string): (at: Vec3) => boolean {
    const shape = this.plan.features.find((feature) => feature.id === id)?.shape;
    const region = shape && "select" in shape ? shape.select?.region : undefined;
    if (!region) return () => true;
    const pose = this.plan.alignment && !this.aligned_from.has(id) ? this.evaluated.datum_from_part : undefined;
    return pose ? (at) => isInRegion(region, moved(pose, at)) : (at) => isInRegion(region, at);
  }
}

/** Ids of the features that a part of a plan names. */
function featuresIn({ features }: Plan, part: unknown): ReadonlySet<string> {
  const found = new Set<string>();
  const visit = (value: unknown) => {
    if (typeof value === "string" && features.some(({ id }) => id === value)) found.add(value);
    else if (typeof value === "object" && value !== null) {
      // A feature may be called like a type.
      for (const [name, part] of Object.entries(value)) if (name !== "type") visit(part);
    }
  };
  visit(part);
  return found;
}

/** Those and the features that they depend on. */
export function featuresBelow(plan: Plan, part: unknown): ReadonlySet<string> {
  const found = new Set<string>();
  const visit = (id: string) => {
    if (found.has(id)) return;
    found.add(id);
    for (const other of featuresIn(plan, plan.features.find((feature) => feature.id === id)?.shape)) visit(other);
  };
  for (const id of featuresIn(plan, part)) visit(id);
  return found;
}
