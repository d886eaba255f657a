/** State of teaching: the tool, its trial on the scan, and the plan that will be published. */

import { computed, signal } from "@preact/signals";
import { data, idempotencyKey, type Schemas } from "../../api/client";
import type { App } from "../../app";
import { succeeded } from "../../components/job/job_problem";
import type { Box } from "../../scene/cloud/cloud";
import { goTo } from "../../state/browser/route";
import type { Inspection } from "../../state/records/inspections";
import { Command } from "../../state/station/command";
import { ResultState } from "../result/result_state";
import type { Measurement, Scan } from "../result/scan_record";
import {
  boxInDatum,
  type Characteristic,
  EMPTY_PLAN,
  idFault,
  type Limits,
  limited,
  MEASURED_BY,
  type Plan,
  type PlanFeature,
  partsOf,
  settingsOf,
  type Taught,
  withoutCharacteristic,
  withParts,
} from "./draft";

/** A measured value of what is taught, in the unit of the characteristic. */
export interface Trial {
  measurement: Measurement;
  /** Where it was searched. */
  region: Box | undefined;
  value: number | undefined;
  /** Expanded uncertainty, k = 2. */
  u: number | undefined;
  unit: "mm" | "°";
}

export class TeachState {
  /** The scan with its cloud. */
  readonly result: ResultState;
  readonly taught = signal<Taught>("sphere_diameter");
  readonly id = signal("");
  readonly limits = signal<Limits>({});
  readonly trial = signal<Trial | undefined>(undefined);
  readonly plan = signal<Plan>(EMPTY_PLAN);
  /** Trials of characteristics that were added. */
  readonly values = signal<ReadonlyMap<string, Trial>>(new Map());
  /** The recipe of which the next version is taught; undefined: a new one. */
  readonly base = signal<Schemas["NewestRecipeDto"] | undefined>(undefined);
  readonly new_id = signal("");
  readonly name = signal("");
  readonly reason = signal("");
  readonly published = signal<Schemas["RecipeVersionDto"] | undefined>(undefined);
  readonly id_fault = computed(() => idFault(this.plan.value, this.id.value));
  readonly measure: Command;
  readonly publish: Command;
  readonly evaluate: Command;
  readonly import_file: Command<[File]>;
  /** Starts from the newest version of a recipe, or from nothing. */
  readonly load: Command<[string | undefined]>;

  constructor(
    private readonly app: App,
    readonly scan: Scan,
    /** The inspection of the scanned part, if there is one. */
    readonly inspection: Inspection | undefined,
  ) {
    this.result = new ResultState(app, scan);
    this.measure = new Command(() => this.runTrial());
    this.publish = new Command(() => this.publishPlan());
    this.load = new Command((_steps, id) => this.start(id));
    this.import_file = new Command((_steps, file) => this.importFile(file));
    this.evaluate = new Command(async (steps) => {
      const version = this.published.peek();
      if (!inspection || !version) return;
      const params = { path: { id: inspection.id }, header: { "Idempotency-Key": idempotencyKey() } };
      const body = { recipe: `${version.id}@${version.version}` };
      const job = await data(app.api.POST("/api/v1/inspections/{id}/re-evaluate", { params, body }));
      // Without `wait_s` the response is a job.
      if (!("state" in job)) return goTo("inspections", job.id);
      app.jobs.update(job);
      steps.accepted();
      goTo("inspections", succeeded(await app.jobs.ended(job.id)));
    });
  }

  /** Whether the plan aligns the part, but the pose of this part is unknown. */
  get pose_missing(): boolean {
    return this.plan.value.alignment != null && this.pose() === undefined;
  }

  /** Starts from the newest version of a recipe, or from nothing; what was added is lost. */
  private async start(id: string | undefined): Promise<void> {
    const base = id
      ? await data(this.app.api.GET("/api/v1/recipes/{id}", { params: { path: { id } } }))
      : undefined;
    this.base.value = base;
    this.plan.value = base?.recipe.plan ?? EMPTY_PLAN;
    this.values.value = new Map();
    this.published.value = undefined;
  }

  /** Publishes the content of an earlier version again; the reason is that of the form, if there is one. */
  async rollBack(to_version: number, default_reason: string): Promise<void> {
    const base = this.base.peek();
    if (!base) return;
    const params = {
      path: { id: base.id },
      header: { "Idempotency-Key": idempotencyKey(), "If-Match": `"${base.version}"` },
    };
    const body = { to_version, reason: this.reason.peek().trim() || default_reason };
    await data(this.app.api.POST("/api/v1/recipes/{id}/roll-back", { params, body }));
    this.reason.value = "";
    await this.start(base.id);
  }

  /** Imports the file of another station, as the next version if there is a recipe with its id. */
  async importFile(file: File): Promise<void> {
    const { api } = this.app;
    const body = JSON.parse(await file.text()) as Schemas["RecipeFileDto"];
    const { response } = await api.GET("/api/v1/recipes/{id}", { params: { path: { id: body.id } } });
    const known = response.ok ? { "If-Match": response.headers.get("ETag") ?? "*" } : {};
    const params = { header: { "Idempotency-Key": idempotencyKey(), ...known } };
    const version = await data(api.POST("/api/v1/recipes/import", { params, body }));
    await this.start(version.id);
    this.published.value = version;
  }

  choose(taught: Taught): void {
    this.taught.value = taught;
    this.trial.value = undefined;
    this.limits.value = {};
  }

  /** Adds the characteristic with its features to the plan. */
  add(): void {
    const [taught, id, trial] = [this.taught.peek(), this.id.peek(), this.trial.peek()];
    const region = trial ? trial.region : this.region();
    const fitted = trial?.measurement.result.features ?? [];
    const parts = partsOf(taught, id, region, fitted);
    const features = parts.features.map((feature) => this.featureInFrameOfPlan(feature));
    const characteristic = limited(parts.characteristic, this.limits.peek());
    this.plan.value = withParts(this.plan.peek(), { features, characteristic });
    if (trial) this.values.value = new Map([...this.values.peek(), [id, trial]]);
    this.trial.value = undefined;
    this.limits.value = {};
    this.id.value = "";
  }

  /** Adds a feature that is searched in the region. */
  addFeature(from: (region: Box | undefined) => PlanFeature): void {
    const feature = this.featureInFrameOfPlan(from(this.region()));
    const plan = this.plan.peek();
    this.plan.value = { ...plan, features: [...plan.features, feature] };
  }

  addCharacteristic(characteristic: Characteristic): void {
    this.plan.value = withParts(this.plan.peek(), { features: [], characteristic });
  }

  remove(id: string): void {
    this.plan.value = withoutCharacteristic(this.plan.peek(), id);
  }

  private region(): Box | undefined {
    return this.result.view.region.peek();
  }

  /** Measures the tool on the scan, within the region. */
  private async runTrial(): Promise<void> {
    const measured_by = MEASURED_BY[this.taught.peek()];
    if (!measured_by) return;
    const { tool, factor } = measured_by;
    const region = this.region();
    const name = this.id.peek();
    const body = {
      tool,
      ...(region && { region_mm: [...region.min, ...region.max] }),
      ...(name !== "" && { name }),
    };
    const params = { path: { id: this.scan.id }, header: { "Idempotency-Key": idempotencyKey() } };
    this.trial.value = undefined;
    const measurement = await data(this.app.api.POST("/api/v1/scans/{id}/measurements", { params, body }));
    const { value, expanded_uncertainty: u, unit } = measurement.result;
    this.trial.value = {
      measurement,
      region,
      value: value == null ? undefined : factor * value,
      u: u == null ? undefined : factor * u,
      unit: unit === "°" ? "°" : "mm",
    };
    this.result.showDeviation(measurement);
  }

  private pose(): Schemas["PoseDto"] | undefined {
    const { inspection } = this;
    return inspection?.recipe.id === this.base.value?.id ? (inspection?.datum_from_part ?? undefined) : undefined;
  }

  /** With its region in the frame of the plan, which is the datum frame if the plan aligns the part. */
  private featureInFrameOfPlan(feature: PlanFeature): PlanFeature {
    const pose = this.plan.peek().alignment ? this.pose() : undefined;
    const { shape } = feature;
    const region = "select" in shape ? shape.select?.region : undefined;
    if (!pose || !("select" in shape) || region?.type !== "box") return feature;
    const [min, max] = [region.min_mm, region.max_mm] as [Box["min"], Box["max"]];
    const box = boxInDatum({ min, max }, pose);
    const select = { ...shape.select, region: { type: "box" as const, min_mm: box.min, max_mm: box.max } };
    return { ...feature, shape: { ...shape, select } };
  }

  private async publishPlan(): Promise<void> {
    const { api } = this.app;
    const [base, plan, reason] = [this.base.peek(), this.plan.peek(), this.reason.peek()];
    const header = { "Idempotency-Key": idempotencyKey() };
    if (base) {
      const recipe = { ...base.recipe, plan };
      const params = { path: { id: base.id }, header: { ...header, "If-Match": `"${base.version}"` } };
      this.published.value = await data(
        api.POST("/api/v1/recipes/{id}/versions", { params, body: { reason, recipe } }),
      );
    } else {
      const id = this.new_id.peek();
      const recipe = { name: this.name.peek() || id, scan: settingsOf(this.scan.plan), plan };
      this.published.value = await data(
        api.POST("/api/v1/recipes", { params: { header }, body: { id, reason, recipe } }),
      );
    }
    // A further change is the next version of what was published.
    const { id } = this.published.peek() ?? {};
    if (id) this.base.value = await data(api.GET("/api/v1/recipes/{id}", { params: { path: { id } } }));
    this.reason.value = "";
  }
}
