/** State of the form for a surface profile: stored models, upload, and what is entered. */

import { batch, computed, signal } from "@preact/signals";
import { type Api, data, idempotencyKey } from "../../../api/client";
import type { Box } from "../../../scene/cloud/cloud";
import { AXES } from "../../../scene/cloud/space";
import { Command } from "../../../state/station/command";
import { idFault } from "../draft";
import type { TeachState } from "../teach_state";
import { type Model, NO_POSE, proposedPose, type StartPose, surfaceProfile } from "./profile";

/** Models offered, newest first. */
const OFFERED = 200;

export class SurfaceDraft {
  readonly models = signal<readonly Model[]>([]);
  readonly model = signal<Model | undefined>(undefined);
  readonly best_fit = signal(false);
  readonly start = signal<StartPose>(NO_POSE);
  /** The box of the model that is toleranced. */
  readonly region = signal<Box | undefined>(undefined);
  readonly reach_mm = signal<number | undefined>(undefined);
  readonly width_mm = signal<number | undefined>(undefined);
  readonly id = signal("");
  readonly is_aligned = computed(() => this.state.plan.value.alignment != null);
  readonly id_fault = computed(() => idFault(this.state.plan.value, this.id.value));
  readonly load: Command;
  readonly upload: Command<[File]>;

  constructor(
    api: Api,
    private readonly state: TeachState,
  ) {
    this.load = new Command(async () => {
      this.models.value = (await data(api.GET("/api/v1/models", { params: { query: { limit: OFFERED } } }))).items;
    });
    this.upload = new Command(async (_steps, file) => {
      const params = { query: { name: file.name }, header: { "Idempotency-Key": idempotencyKey() } };
      const headers = { "Content-Type": "application/octet-stream" };
      const request = { params, headers, body: [], bodySerializer: () => file };
      const model = await data(api.POST("/api/v1/models", request));
      await this.load.start();
      this.choose(model);
    });
  }

  /** Chooses a model and proposes its pose. */
  choose(model: Model | undefined): void {
    batch(() => {
      this.model.value = model;
      this.region.value = undefined;
      this.propose();
    });
  }

  /** Proposes the pose of the model in the region, or in the cloud. */
  propose(): void {
    const model = this.model.peek();
    if (model) this.start.value = proposedPose(model.summary, this.box());
  }

  /** Adds the characteristic to the plan, which evaluates it. */
  add(): void {
    const model = this.model.peek();
    if (!model) return;
    const [best_fit, start] = [this.best_fit.peek(), this.start.peek()];
    const [reach_mm, width_mm] = [this.reach_mm.peek(), this.width_mm.peek()];
    const region = this.region.peek();
    const entries = { model, best_fit, start, region, reach_mm, width_mm };
    this.state.addCharacteristic(surfaceProfile(this.id.peek(), entries, this.is_aligned.peek()));
    this.id.value = "";
  }

  private box(): Box {
    const { view } = this.state.result;
    const [x, y, z] = AXES.map((axis) => view.extent(axis));
    const at = (end: 0 | 1): Box["min"] => [x?.[end] ?? 0, y?.[end] ?? 0, z?.[end] ?? 0];
    return view.region.peek() ?? { min: at(0), max: at(1) };
  }
}
