/** The cloud of an inspected part: places of its characteristics, and the deviation map of the current one. */

import { effect, signal } from "@preact/signals";
import type { Schemas } from "../../api/client";
import type { App } from "../../app";
import type { CloudViewer } from "../../scene/view/viewer";
import type { Inspection } from "../../state/records/inspections";
import { ResultState } from "../result/result_state";
import type { Scan } from "../result/scan_record";
import { PlanOnCloud } from "../viewer/plan_on_cloud";
import { SurfaceDeviations } from "../viewer/surface_deviations";

export class PartState {
  readonly result: ResultState;
  readonly on_cloud: PlanOnCloud;
  /** Its deviations from CAD models. */
  readonly surface: SurfaceDeviations;
  /** The characteristic that is highlighted in the table and on the cloud. */
  readonly current = signal<string | undefined>(undefined);
  private viewer: CloudViewer | undefined;
  private end_feed: (() => void) | undefined;

  constructor(app: App, inspection: Inspection, plan: Schemas["Plan"], scan: Scan) {
    this.result = new ResultState(app, scan);
    this.on_cloud = new PlanOnCloud(plan, inspection, () => this.viewer?.cloud);
    const compared = signal({ plan, results: inspection.results });
    this.surface = new SurfaceDeviations(scan.id, compared, this.result.view);
  }

  /** Keeps labels and highlights up to date until the returned function is called. */
  follow(): () => void {
    const { view } = this.result;
    view.onLabel = (id) => this.surface.showLabelled(id) || this.show(id);
    const ends = [
      effect(() => {
        view.labels.value = [...this.on_cloud.labels(this.current.value), ...this.surface.labels.value];
      }),
      effect(() => {
        const picked = view.picks.value.at(-1)?.displayed.position_mm;
        const found = picked && this.on_cloud.characteristicAt(picked);
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
    this.end_feed = viewer && this.result.feed(viewer);
  }

  /** Whether a characteristic has a place on the cloud, or a comparison that colours it. */
  canShow(id: string): boolean {
    return this.on_cloud.places.has(id) || this.surface.comparison(id) !== undefined;
  }

  /** Called by its row: the cloud comes into view. */
  showFromRow(id: string): void {
    this.show(id);
    this.result.view.reveal();
  }

  /** Highlights a characteristic and colours the cloud by the distance from its feature or its model. */
  show(id: string): void {
    this.current.value = id;
    if (this.surface.comparison(id)) void this.surface.show(id).start();
    else this.on_cloud.show(id, this.result.view);
  }
}
