/** One scan with its measurements, and what a person does with it. */

import { type Signal, signal } from "@preact/signals";
import { type Api, bytes, data, idempotencyKey, type Problem, problemOf } from "../../api/client";
import { textOf } from "../../api/unknown";
import type { App } from "../../app";
import { succeeded } from "../../components/job/job_problem";
import { BlockFeed } from "../../scene/cloud/block_feed";
import { exactPoint } from "../../scene/cloud/exact_point";
import { meshFromGlb } from "../../scene/cloud/glb";
import { fetchPoints } from "../../scene/cloud/points_source";
import { RegionGrid } from "../../scene/cloud/region";
import { shapeOf } from "../../scene/cloud/shapes";
import type { CloudViewer } from "../../scene/view/viewer";
import { goTo } from "../../state/browser/route";
import type { Tool } from "../../state/choices";
import type { Damaged } from "../../state/records/damaged";
import type { StationEvent } from "../../state/records/events";
import type { Verdict } from "../../state/records/scanned";
import { Command } from "../../state/station/command";
import { ViewState } from "../viewer/view_state";
import type { Measurement, Scan } from "./scan_record";

/** The deviation colours of a measurement belong to its feature with most points. */
export function featureOf(measurement: Measurement) {
  const features = measurement.result.features ?? [];
  return [...features].sort((a, b) => b.n_points - a.n_points)[0];
}

export class ResultState {
  readonly view: ViewState;
  readonly measurements = signal<readonly Measurement[]>([]);
  /** On the part, as the server states it. */
  readonly verdict: Signal<Verdict | undefined>;
  /** Measurements that cannot be shown. */
  readonly damaged = signal<readonly Damaged[]>([]);
  /** The measurement whose fitted shape gives the deviations. */
  readonly selected = signal<string | undefined>(undefined);
  /** Why points or measurements could not be fetched. */
  readonly problem = signal<Problem | undefined>(undefined);
  readonly tool = signal<Tool>("sphere");
  readonly nominal = signal<number | undefined>(undefined);
  readonly tolerance = signal<number | undefined>(undefined);
  readonly measure: Command;
  readonly loadMesh: Command;
  readonly recalibration = signal("");
  readonly recompute: Command;

  constructor(
    private readonly app: App,
    readonly scan: Scan,
  ) {
    const { api } = app;
    this.verdict = signal(scan.verdict ?? undefined);
    this.view = new ViewState(async (picked) => await exactPoint(api, scan.id, picked));
    this.measure = new Command(async () => {
      const measured = await data(
        api.POST("/api/v1/scans/{id}/measurements", { params: this.params(), body: this.request() }),
      );
      await this.load();
      this.select(measured);
    });
    this.loadMesh = new Command(async () => {
      const file = await bytes(`/api/v1/scans/${encodeURIComponent(scan.id)}/mesh?format=glb`);
      this.view.mesh.value = meshFromGlb(await file.arrayBuffer());
      this.view.shown.value = "mesh";
      if (this.view.mode.peek() === "order") this.view.mode.value = "height";
    });
    this.recompute = new Command(async (steps) => {
      const calibration_id = this.recalibration.peek();
      const body = calibration_id === "" ? {} : { calibration_id };
      const job = await data(api.POST("/api/v1/scans/{id}/recompute", { params: this.params(), body }));
      app.jobs.update(job);
      steps.accepted();
      goTo("result", succeeded(await app.jobs.ended(job.id)));
    });
  }

  /** Reads again when something was measured, here or elsewhere; the returned function ends it. */
  follow(): () => void {
    void this.load();
    return this.app.events.follow((new_events) => {
      const ours = ({ kind, body }: StationEvent) =>
        kind.startsWith("measurement.") && textOf(body, "scan_id") === this.scan.id;
      if (new_events.length === 0 || new_events.some(ours)) void this.load();
    });
  }

  /** Reads the measurements that are there, and the verdict. */
  async load(): Promise<void> {
    try {
      const params = { path: { id: this.scan.id }, query: { limit: 200 } };
      const [{ items, damaged }, scan] = await Promise.all([
        data(this.app.api.GET("/api/v1/scans/{id}/measurements", { params })),
        data(this.app.api.GET("/api/v1/scans/{id}", { params: { path: { id: this.scan.id } } })),
      ]);
      this.damaged.value = damaged ?? [];
      this.measurements.value = items;
      this.verdict.value = scan.verdict ?? undefined;
      const shaped = items.find(featureOf);
      if (shaped && this.selected.peek() === undefined) this.select(shaped);
    } catch (cause) {
      this.problem.value = problemOf(cause);
    }
  }

  /** Deviations refer to the fitted shape of this measurement. */
  select(measurement: Measurement): void {
    const feature = featureOf(measurement);
    if (!feature) return;
    this.selected.value = measurement.id;
    const grid = feature.region ? new RegionGrid(feature.region) : undefined;
    this.view.feature.value = { shape: shapeOf(feature.shape), grid };
    this.view.shape_name.value = feature.role;
    // Another shape has other deviations.
    const { deviation: _, ...others } = this.view.custom_ranges.peek();
    this.view.custom_ranges.value = others;
  }

  /** Colours the cloud by the distance from this measurement's fitted shape. */
  showDeviation(measurement: Measurement): void {
    this.select(measurement);
    this.view.mode.value = "deviation";
  }

  /** Fills a viewer with the points of the scan until the returned function is called. */
  feed(viewer: CloudViewer): () => void {
    let wanted = true;
    const feed = new BlockFeed(fetchPoints, {
      onBlock: (block) => wanted && viewer.append(block),
      onReset: () => wanted && viewer.clear(),
      onProblem: (cause) => {
        if (wanted) this.problem.value = problemOf(cause);
      },
    });
    void feed.show(this.scan.id);
    const end = this.app.stream.onReconnect(() => feed.reconnected());
    return () => {
      wanted = false;
      end();
    };
  }

  private params(): { path: { id: string }; header: { "Idempotency-Key": string } } {
    return { path: { id: this.scan.id }, header: { "Idempotency-Key": idempotencyKey() } };
  }

  private request() {
    const [nominal_mm, tolerance_mm] = [this.nominal.peek(), this.tolerance.peek()];
    return {
      tool: this.tool.peek(),
      ...(nominal_mm !== undefined && { nominal_mm }),
      ...(tolerance_mm !== undefined && { tolerance_mm }),
    };
  }
}

/** The scan a page is about; without an id the newest. Undefined where there is none at all. */
export async function findScan(api: Api, id: string | undefined): Promise<Scan | undefined> {
  if (id) return await data(api.GET("/api/v1/scans/{id}", { params: { path: { id } } }));
  const { items } = await data(api.GET("/api/v1/scans", { params: { query: { limit: 1 } } }));
  return items[0];
}
