/** The recipe that is taught: what it starts from, and its next version. */

import { batch, type Signal, signal } from "@preact/signals";
import { data, idempotencyKey, type Schemas } from "../../../api/client";
import type { App } from "../../../app";
import { succeeded } from "../../../components/job/job_problem";
import { goTo } from "../../../state/browser/route";
import type { Inspection } from "../../../state/records/inspections";
import { Command, type Steps } from "../../../state/station/command";
import type { Scan } from "../../result/scan_record";
import { EMPTY_PLAN, type Plan } from "../draft";
import { RecipeSettings } from "../settings/recipe_settings";
import { recipeFile } from "./recipe_file";

/** The plan that is taught. */
interface TaughtPlan {
  readonly plan: Signal<Plan>;
  /** Replaces the plan; what was added to it is lost. */
  replacePlan(plan: Plan): void;
}

export class RecipeState {
  /** The recipe of which the next version is taught; undefined: a new one. */
  readonly base = signal<Schemas["NewestRecipeDto"] | undefined>(undefined);
  readonly new_id = signal("");
  readonly settings: RecipeSettings;
  readonly reason = signal("");
  readonly published = signal<Schemas["RecipeVersionDto"] | undefined>(undefined);
  readonly publish: Command;
  /** Evaluates the part of the inspection with the version that was published. */
  readonly evaluate: Command;
  readonly import_file: Command<[File]>;
  /** Starts from the newest version of a recipe, or from nothing. */
  readonly load: Command<[string | undefined]>;

  constructor(
    private readonly app: App,
    scan: Scan,
    /** The inspection of the scanned part, if there is one. */
    readonly inspection: Inspection | undefined,
    private readonly taught: TaughtPlan,
  ) {
    this.settings = new RecipeSettings(scan.plan);
    this.publish = new Command(() => this.publishNext());
    this.load = new Command((_steps, id) => this.start(id));
    this.import_file = new Command((_steps, file) => this.importFile(file));
    this.evaluate = new Command((steps) => this.evaluatePart(steps));
  }

  /** Starts from the newest version of a recipe, or from nothing; what was added is lost. */
  private async start(id: string | undefined): Promise<void> {
    const base = id
      ? await data(this.app.api.GET("/api/v1/recipes/{id}", { params: { path: { id } } }))
      : undefined;
    this.base.value = base;
    this.taught.replacePlan(base?.recipe.plan ?? EMPTY_PLAN);
    this.settings.start(base?.recipe);
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
    const reason = this.reason.peek();
    const body = { to_version, reason: reason.trim() || default_reason };
    await data(this.app.api.POST("/api/v1/recipes/{id}/roll-back", { params, body }));
    this.clearReason(reason);
    await this.start(base.id);
  }

  /** Imports the file of another station, as the next version if there is a recipe with its id. */
  private async importFile(file: File): Promise<void> {
    const { api } = this.app;
    const body = recipeFile(await file.text());
    const { response } = await api.GET("/api/v1/recipes/{id}", { params: { path: { id: body.id } } });
    const known = response.ok ? { "If-Match": response.headers.get("ETag") ?? "*" } : {};
    const params = { header: { "Idempotency-Key": idempotencyKey(), ...known } };
    const version = await data(api.POST("/api/v1/recipes/import", { params, body }));
    await this.start(version.id);
    this.published.value = version;
  }

  private async publishNext(): Promise<void> {
    const { api } = this.app;
    const [base, new_id, reason] = [this.base.peek(), this.new_id.peek(), this.reason.peek()];
    const recipe = { ...this.settings.content(base?.id ?? new_id), plan: this.taught.plan.peek() };
    const header = { "Idempotency-Key": idempotencyKey() };
    const version = base
      ? await data(
          api.POST("/api/v1/recipes/{id}/versions", {
            params: { path: { id: base.id }, header: { ...header, "If-Match": `"${base.version}"` } },
            body: { reason, recipe },
          }),
        )
      : await data(api.POST("/api/v1/recipes", { params: { header }, body: { id: new_id, reason, recipe } }));
    batch(() => {
      this.published.value = version;
      this.clearReason(reason);
    });
    // A further change is the next version of what was published.
    this.base.value = await data(api.GET("/api/v1/recipes/{id}", { params: { path: { id: version.id } } }));
  }

  private async evaluatePart(steps: Steps): Promise<void> {
    const { api, jobs } = this.app;
    const version = this.published.peek();
    if (!this.inspection || !version) return;
    const params = { path: { id: this.inspection.id }, header: { "Idempotency-Key": idempotencyKey() } };
    const body = { recipe: `${version.id}@${version.version}` };
    const job = await data(api.POST("/api/v1/inspections/{id}/re-evaluate", { params, body }));
    // Without `wait_s` the response is a job.
    if (!("state" in job)) return goTo("inspections", job.id);
    jobs.update(job);
    steps.accepted();
    goTo("inspections", succeeded(await jobs.ended(job.id)));
  }

  /** Empties the field of a reason that was used; one that was typed meanwhile is for the next version. */
  private clearReason(used: string): void {
    if (this.reason.peek() === used) this.reason.value = "";
  }
}
