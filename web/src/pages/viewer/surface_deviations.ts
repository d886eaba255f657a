/** Deviations from CAD models on the displayed cloud: its colours, and the places of the largest deviations. */

import { computed, type ReadonlySignal, signal } from "@preact/signals";
import { bytes, type Schemas } from "../../api/client";
import { DeviationMap, decodeDeviations } from "../../scene/cloud/deviation_map";
import { inverse, moved } from "../../scene/cloud/fitted";
import type { Feature } from "../../scene/cloud/region";
import { type Vec3, vec3 } from "../../scene/cloud/shapes";
import type { ColourMode } from "../../scene/colours";
import type { Label } from "../../scene/view/overlay";
import type { CharacteristicResult } from "../../state/records/inspections";
import { Command } from "../../state/station/command";
import type { ViewState } from "./view_state";

type Plan = Schemas["Plan"];
export type Comparison = Schemas["ComparisonDto"];

/** A plan with its results on the scan. */
export interface Compared {
  plan: Plan;
  results: readonly CharacteristicResult[];
}

/** One of the largest deviations of a characteristic, by its index in the list. */
export interface WorstPlace {
  id: string;
  idx: number;
}

/** Separates id and index in the names of labels; ids do not contain it. */
const SEPARATOR = "/";

/** The largest deviation that gets a colour of its own, µm: the tolerance, or that of nearly all points. */
export function halfRange_um({ tolerance_mm, percentiles }: Comparison): number {
  const { p2_5_mm, p97_5_mm } = percentiles;
  return 1e3 * (tolerance_mm ?? Math.max(Math.abs(p2_5_mm), Math.abs(p97_5_mm), 1e-3));
}

/** A place of the model in the frame of the scan. */
export function onScan({ datum_from_part }: Comparison, at_mm: readonly number[]): Vec3 {
  return moved(inverse(datum_from_part), vec3(at_mm));
}

export class SurfaceDeviations {
  /** The place that is highlighted in its table and on the cloud. */
  readonly place = signal<WorstPlace | undefined>(undefined);
  /** The characteristic by whose deviations the cloud is coloured. */
  readonly shown: ReadonlySignal<string | undefined> = computed(() => {
    const { mode, feature } = this.view;
    return mode.value === "deviation" && feature.value === this.loaded.value?.feature
      ? this.loaded.value?.id
      : undefined;
  });
  /** Labels of the places of what is shown. */
  readonly labels: ReadonlySignal<readonly Label[]> = computed(() => {
    const place = this.place.value;
    const id = this.shown.value ?? place?.id;
    const comparison = id === undefined ? undefined : this.comparison(id);
    if (!comparison) return [];
    return comparison.worst.map(({ at_mm }, idx) => ({
      id: `${id}${SEPARATOR}${idx}`,
      text: `${idx + 1}`,
      at: onScan(comparison, at_mm),
      current: place?.id === id && place?.idx === idx,
    }));
  });
  private readonly loaded = signal<{ id: string; plan: Plan; feature: Feature } | undefined>(undefined);
  private readonly commands = new Map<string, Command>();
  private mode_before: ColourMode = "height";

  constructor(
    private readonly scan_id: string,
    private readonly compared: ReadonlySignal<Compared | undefined>,
    private readonly view: ViewState,
  ) {}

  /** Colours the cloud by the deviations of a characteristic. */
  show(id: string): Command {
    const known = this.commands.get(id) ?? new Command(() => this.load(id));
    this.commands.set(id, known);
    return known;
  }

  /** Colours the cloud as before. */
  hide(): void {
    this.place.value = undefined;
    this.view.mode.value = this.mode_before;
  }

  /** Highlights one of the largest deviations. */
  showPlace(place: WorstPlace): void {
    this.place.value = place;
    if (this.shown.peek() !== place.id) void this.show(place.id).start();
  }

  /** Highlights the place of a label; returns whether it is the label of one. */
  showLabelled(label: string): boolean {
    const [id = "", idx] = label.split(SEPARATOR);
    if (idx !== undefined) this.showPlace({ id, idx: Number(idx) });
    return idx !== undefined;
  }

  /** The comparison of a characteristic with its model, if it has one. */
  comparison(id: string): Comparison | undefined {
    return this.compared.value?.results.find((result) => result.id === id)?.comparison ?? undefined;
  }

  private async load(id: string): Promise<void> {
    const compared = this.compared.peek();
    const comparison = this.comparison(id);
    if (!compared || !comparison) return;
    const { plan } = compared;
    const known = this.loaded.peek();
    const feature =
      known?.id === id && known.plan === plan ? known.feature : await this.fetch(plan, id, comparison);
    if (this.view.mode.peek() !== "deviation") this.mode_before = this.view.mode.peek();
    this.loaded.value = { id, plan, feature };
    this.view.showDeviation(feature, nameOfModel(plan, id));
  }

  private async fetch(plan: Plan, characteristic: string, comparison: Comparison): Promise<Feature> {
    const response = await bytes(`/api/v1/scans/${encodeURIComponent(this.scan_id)}/deviations`, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ plan, characteristic }),
    });
    const map = new DeviationMap(decodeDeviations(await response.arrayBuffer()));
    return { shape: { kind: "model", map }, half_range_um: halfRange_um(comparison) };
  }
}

function nameOfModel({ characteristics }: Plan, id: string): string {
  const measure = characteristics.find((one) => one.id === id)?.measure;
  return measure?.type === "surface_profile" ? measure.model.name : id;
}
