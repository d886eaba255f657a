/** State of teaching: what is measured next, its trial on the scan, and the plan of the recipe. */

import { batch, computed, effect, type ReadonlySignal, signal } from "@preact/signals";
import { data } from "../../api/client";
import type { App } from "../../app";
import type { Box } from "../../scene/cloud/cloud";
import { inverse, type Pose } from "../../scene/cloud/fitted";
import type { CloudViewer } from "../../scene/view/viewer";
import type { CharacteristicResult, Inspection } from "../../state/records/inspections";
import { Command } from "../../state/station/command";
import { text } from "../../text";
import { ResultState } from "../result/result_state";
import type { Scan } from "../result/scan_record";
import { PlanOnCloud } from "../viewer/plan_on_cloud";
import { SurfaceDeviations } from "../viewer/surface_deviations";
import { type Alignment, inFrame, withAlignment } from "./alignment/frame";
import {
  type Candidate,
  type Characteristic,
  EMPTY_PLAN,
  type Fitted,
  FOUND_BY,
  freeId,
  idFault,
  type Limits,
  limited,
  type Parts,
  type Plan,
  type PlanFeature,
  partsOf,
  type Taught,
  withoutCharacteristic,
  withParts,
} from "./draft";
import { PlanTrial } from "./plan_trial";
import { RecipeState } from "./recipe/recipe_state";

export class TeachState {
  /** The scan with its cloud. */
  readonly result: ResultState;
  readonly taught = signal<Taught>("sphere_diameter");
  readonly id = signal("");
  readonly limits = signal<Limits>({});
  readonly plan = signal<Plan>(EMPTY_PLAN);
  /** What was measured and is not added yet. */
  readonly candidate = signal<Candidate | undefined>(undefined);
  /** The name of the candidate until it is added. */
  readonly trial_id = signal("");
  /** The plan with the candidate. */
  readonly tried: ReadonlySignal<Plan> = computed(() => {
    const candidate = this.candidate.value;
    return candidate ? withParts(this.plan.value, this.partsOf(candidate, this.trial_id.value)) : this.plan.value;
  });
  readonly trial: PlanTrial;
  /** Whether the answers are those of the plan as it is now. */
  readonly is_current = computed(() => this.trial.answered.value?.plan === this.tried.value);
  /** Results on this scan by characteristic, of an earlier plan while the present one is evaluated. */
  readonly results = computed<ReadonlyMap<string, CharacteristicResult>>(
    () => new Map(this.trial.answered.value?.said.results.map((result) => [result.id, result])),
  );
  /** Whether a characteristic of the plan has limits, so that there is a verdict. */
  readonly has_limits = computed(() =>
    this.plan.value.characteristics.some(({ lower, upper }) => lower != null || upper != null),
  );
  /** The result of the candidate. */
  readonly candidate_result = computed(() =>
    this.candidate.value ? this.results.value.get(this.trial_id.value) : undefined,
  );
  /** The datum frame of this part, if the plan has an alignment and its features were found. */
  readonly pose = computed<Pose | undefined>(() => {
    const { alignment } = this.plan.value;
    const { plan, said } = this.trial.answered.value ?? {};
    const known = this.aligned.value;
    if (!alignment) return undefined;
    if (plan?.alignment === alignment && said?.datum_from_part) return said.datum_from_part;
    return known?.alignment === alignment ? known.pose : undefined;
  });
  /** Why no region can be added: the plan aligns the part, but the datum frame of this part is unknown. */
  readonly pose_blocked = computed(() => {
    const words = text.value.teach;
    if (!this.plan.value.alignment || this.pose.value) return undefined;
    return this.trial.running.value ? words.evaluating : words.pose_missing;
  });
  /** The characteristic that is highlighted on the cloud. */
  readonly current = signal<string | undefined>(undefined);
  readonly on_cloud = computed(() => {
    const answered = this.trial.answered.value;
    return answered && new PlanOnCloud(answered.plan, answered.said, () => this.viewer?.cloud);
  });
  /** Deviations from CAD models, of the plan that was evaluated last. */
  readonly surface: SurfaceDeviations;
  /** The recipe that is published with the plan. */
  readonly recipe: RecipeState;
  readonly id_fault = computed(() => idFault(this.plan.value, this.id.value));
  readonly measure: Command;
  /** The alignment that was made here, with its datum frame. */
  private readonly aligned = signal<{ alignment: Alignment; pose: Pose } | undefined>(undefined);
  /** Features as they were in the frame of the scan: a box that is turned twice is larger. */
  private readonly in_scan = new WeakMap<PlanFeature, PlanFeature>();
  private viewer: CloudViewer | undefined;
  private end_feed: (() => void) | undefined;
  private evaluating: Promise<void> = Promise.resolve();

  constructor(
    private readonly app: App,
    readonly scan: Scan,
    /** The inspection of the scanned part, if there is one. */
    inspection: Inspection | undefined,
  ) {
    this.result = new ResultState(app, scan);
    this.trial = new PlanTrial(app.api, scan.id);
    this.surface = new SurfaceDeviations(scan.id, this.trial.compared, this.result.view);
    this.measure = new Command(() => this.tryCandidate());
    this.recipe = new RecipeState(app, scan, inspection, this);
  }

  /** Evaluates the plan whenever it changes, until the returned function is called. */
  follow(): () => void {
    const { view } = this.result;
    view.onLabel = (id) => this.surface.showLabelled(id) || this.show(id);
    const ends = [
      effect(() => {
        const tried = this.tried.value;
        const is_empty = tried.features.length + tried.characteristics.length === 0;
        if (!this.scan.cloud || is_empty) this.trial.clear();
        else if (this.trial.answered.peek()?.plan === tried) this.trial.cancel();
        else this.evaluating = this.trial.evaluate(tried);
      }),
      effect(() => {
        const features = this.on_cloud.value?.labels(this.current.value) ?? [];
        view.labels.value = [...features, ...this.surface.labels.value];
      }),
    ];
    return () => {
      for (const end of ends) end();
      view.onLabel = undefined;
      this.trial.cancel();
    };
  }

  onViewer(viewer: CloudViewer | undefined): void {
    this.end_feed?.();
    this.viewer = viewer;
    this.end_feed = viewer && this.result.feed(viewer);
  }

  /** Colours the cloud by the distance from the feature or the model of a characteristic. */
  show(id: string): void {
    this.current.value = id;
    if (this.surface.comparison(id)) void this.surface.show(id).start();
    else this.on_cloud.peek()?.show(id, this.result.view);
  }

  /** Replaces the plan; what was added to it is lost. */
  replacePlan(plan: Plan): void {
    this.trial.clear();
    batch(() => {
      this.candidate.value = undefined;
      this.plan.value = plan;
    });
  }

  choose(taught: Taught): void {
    batch(() => {
      this.taught.value = taught;
      this.candidate.value = undefined;
      this.limits.value = {};
    });
  }

  /** Adds the candidate to the plan under its name. */
  add(): void {
    const candidate = this.candidate.peek();
    if (!candidate) return;
    batch(() => {
      this.plan.value = withParts(this.plan.peek(), this.partsOf(candidate, this.id.peek()));
      this.candidate.value = undefined;
      this.limits.value = {};
      this.id.value = "";
    });
  }

  /** Adds a feature that is searched in the region. */
  addFeature(from: (region: Box | undefined) => PlanFeature): void {
    const feature = this.inFrameOfPlan(from(this.region()));
    const plan = this.plan.peek();
    this.plan.value = { ...plan, features: [...plan.features, feature] };
  }

  addCharacteristic(characteristic: Characteristic): void {
    this.plan.value = withParts(this.plan.peek(), { features: [], characteristic });
  }

  remove(id: string): void {
    this.plan.value = withoutCharacteristic(this.plan.peek(), id);
  }

  /** Aligns the plan by datums whose frame is `pose` on this scan. */
  align(alignment: Alignment, pose: Pose): void {
    batch(() => {
      this.aligned.value = { alignment, pose };
      this.plan.value = withAlignment(this.plan.peek(), alignment, (feature) => this.moved(feature, pose));
    });
  }

  /** Removes the alignment: all regions are in the frame of the scan again. */
  unalign(): void {
    const pose = this.pose.peek();
    if (!pose) return;
    const back = inverse(pose);
    const moveBack = (feature: PlanFeature) => this.in_scan.get(feature) ?? inFrame(feature, back);
    this.plan.value = withAlignment(this.plan.peek(), undefined, moveBack);
  }

  /** A feature that was selected on the scan, in the frame of the plan. */
  private inFrameOfPlan(feature: PlanFeature): PlanFeature {
    const pose = this.pose.peek();
    return pose ? this.moved(feature, pose) : feature;
  }

  private moved(feature: PlanFeature, pose: Pose): PlanFeature {
    const moved = inFrame(feature, pose);
    this.in_scan.set(moved, feature);
    return moved;
  }

  private region(): Box | undefined {
    return this.result.view.region.peek();
  }

  /** Finds the features of what is chosen within the region, and evaluates the plan with them. */
  private async tryCandidate(): Promise<void> {
    const [taught, region, id] = [this.taught.peek(), this.region(), this.id.peek()];
    const found = await this.find(taught, region).catch((cause: unknown) => {
      this.candidate.value = undefined;
      throw cause;
    });
    if (this.taught.peek() !== taught) return;
    batch(() => {
      this.trial_id.value = idFault(this.plan.peek(), id) ? freeId(this.plan.peek()) : id;
      this.candidate.value = { taught, region, found };
    });
    await this.evaluating;
    if (this.is_current.peek()) this.show(this.trial_id.peek());
  }

  /** The features that the tool for what is chosen finds within a region. */
  private async find(taught: Taught, region: Box | undefined): Promise<readonly Fitted[]> {
    const tool = FOUND_BY[taught];
    if (!tool) return [];
    const params = { path: { id: this.scan.id } };
    const body = { tool, ...(region && { region_mm: [...region.min, ...region.max] }) };
    return (await data(this.app.api.POST("/api/v1/scans/{id}/find-features", { params, body }))).features;
  }

  /** The features and the characteristic of a candidate, in the frame of the plan, with its limits. */
  private partsOf({ taught, region, found }: Candidate, id: string): Parts {
    const { features, characteristic } = partsOf(taught, id, region, found);
    return {
      features: features.map((feature) => this.inFrameOfPlan(feature)),
      characteristic: limited(characteristic, this.limits.value),
    };
  }
}
