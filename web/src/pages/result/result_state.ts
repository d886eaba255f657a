/** State of the result page: a scan, its measurements, and the commands. */

import { effect, type Signal, signal } from "@preact/signals";
import { type Api, bytes, data, idempotencyKey, type Problem, problemOf } from "../../api/client";
import { textOf } from "../../api/unknown";
import type { App } from "../../app";
import { succeeded } from "../../components/job/job_problem";
import { BlockFeed } from "../../scene/cloud/block_feed";
import { exactPoint } from "../../scene/cloud/exact_point";
import { meshFromGlb } from "../../scene/cloud/glb";
import { fetchPoints } from "../../scene/cloud/points_source";
import { featureDeviation, RegionGrid } from "../../scene/cloud/region";
import { addScaled, distance, shapeOf, type Vec3, vec3 } from "../../scene/cloud/shapes";
import type { CloudViewer } from "../../scene/view/viewer";
import { goTo } from "../../state/browser/route";
import type { Tool } from "../../state/choices";
import type { Damaged } from "../../state/records/damaged";
import type { StationEvent } from "../../state/records/events";
import type { Verdict } from "../../state/records/scanned";
import { Command } from "../../state/station/command";
import { text } from "../../text";
import { ViewState } from "../viewer/view_state";
import type { Measurement, Scan } from "./scan_record";

/** The feature with most points, from which deviations are computed. */
export function featureOf(measurement: Measurement) {
  const features = measurement.result.features ?? [];
  return [...features].sort((a, b) => b.n_points - a.n_points)[0];
}

/** The grid of each measurement's feature; grids are large, and measurements never change. */
const grids = new WeakMap<Measurement, RegionGrid>();

function gridOf(measurement: Measurement): RegionGrid | undefined {
  const region = featureOf(measurement)?.region;
  if (!region) return undefined;
  const grid = grids.get(measurement) ?? new RegionGrid(region);
  grids.set(measurement, grid);
  return grid;
}

/** Whether a point belongs to the feature of a measurement. */
function isOn(measurement: Measurement, at: Vec3): boolean {
  const feature = featureOf(measurement);
  const grid = gridOf(measurement);
  return (
    feature !== undefined &&
    grid !== undefined &&
    Number.isFinite(featureDeviation({ shape: shapeOf(feature.shape), grid }, at))
  );
}

/** Where a measurement is labelled: the cell of its feature nearest to the middle of all. */
function placeOf(measurement: Measurement): Vec3 | undefined {
  const region = featureOf(measurement)?.region;
  if (!region) return undefined;
  const [nx = 1, ny = 1] = region.size;
  const origin = vec3(region.origin_mm);
  const centres = region.cells.map((cell): Vec3 => {
    const at: Vec3 = [cell % nx, Math.floor(cell / nx) % ny, Math.floor(cell / (nx * ny))];
    return addScaled(origin, [at[0] + 0.5, at[1] + 0.5, at[2] + 0.5], region.cell_mm);
  });
  const sum = centres.reduce<Vec3>((sum, one) => addScaled(sum, one, 1), [0, 0, 0]);
  const middle = addScaled([0, 0, 0], sum, 1 / Math.max(1, centres.length));
  return centres.sort((a, b) => distance(a, middle) - distance(b, middle))[0];
}

function measuredAs(tool: string): string {
  return text.value.measured_as[tool] ?? tool;
}

export class ResultState {
  readonly view: ViewState;
  readonly measurements = signal<readonly Measurement[]>([]);
  /** The verdict of the part, from the server. */
  readonly verdict: Signal<Verdict | undefined>;
  /** Damaged measurements. */
  readonly damaged = signal<readonly Damaged[]>([]);
  /** The measurement from whose fitted shape deviations are computed. */
  readonly selected = signal<string | undefined>(undefined);
  /** Why points or measurements could not be loaded. */
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

  /** Reloads after new measurements of this scan; returns the function that ends this. */
  follow(): () => void {
    void this.load();
    const end_labels = this.label();
    const end_events = this.app.events.follow((new_events) => {
      const ours = ({ kind, body }: StationEvent) =>
        kind.startsWith("measurement.") && textOf(body, "scan_id") === this.scan.id;
      if (new_events.length === 0 || new_events.some(ours)) void this.load();
    });
    return () => {
      end_labels();
      end_events();
    };
  }

  /** Loads the measurements and the verdict. */
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

  /** Labels the measured features on the cloud; a click on one, or on a point of its surface, selects its row. */
  private label(): () => void {
    this.view.onLabel = (id) => {
      const clicked = this.measurements.peek().find((one) => one.id === id);
      if (clicked) this.showDeviation(clicked);
    };
    const ends = [
      effect(() => {
        const selected = this.selected.value;
        this.view.labels.value = this.measurements.value.flatMap((measurement) => {
          const at = placeOf(measurement);
          const text = measurement.request.name ?? measuredAs(measurement.request.tool);
          return at ? [{ id: measurement.id, text, at, current: measurement.id === selected }] : [];
        });
      }),
      effect(() => {
        const picked = this.view.picks.value.at(-1)?.displayed.position_mm;
        const found = picked && this.measurements.peek().find((one) => isOn(one, picked));
        if (found) this.select(found);
      }),
    ];
    return () => {
      for (const end of ends) end();
    };
  }

  /** Selects the measurement from whose fitted shape deviations are computed. */
  select(measurement: Measurement): void {
    const feature = featureOf(measurement);
    if (!feature) return;
    this.selected.value = measurement.id;
    this.view.deviateFrom({ shape: shapeOf(feature.shape), grid: gridOf(measurement) }, feature.role);
  }

  /** Colours the cloud by the distance from this measurement's fitted shape. */
  showDeviation(measurement: Measurement): void {
    this.select(measurement);
    this.view.mode.value = "deviation";
  }

  /** Sends the points of the scan to a viewer until the returned function is called. */
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
    const region = this.view.region.peek();
    return {
      ...(region && { region_mm: [...region.min, ...region.max] }),
      tool: this.tool.peek(),
      ...(nominal_mm !== undefined && { nominal_mm }),
      ...(tolerance_mm !== undefined && { tolerance_mm }),
    };
  }
}

/** Loads a scan; without an id the newest; undefined if there are no scans. */
export async function findScan(api: Api, id: string | undefined): Promise<Scan | undefined> {
  if (id) return await data(api.GET("/api/v1/scans/{id}", { params: { path: { id } } }));
  const { items } = await data(api.GET("/api/v1/scans", { params: { query: { limit: 1 } } }));
  return items[0];
}
