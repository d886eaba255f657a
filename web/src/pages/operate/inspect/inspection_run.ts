/** The command of Start with a recipe: one job of the server that scans, measures and decides the verdict. */

import { computed, type ReadonlySignal, type Signal, signal } from "@preact/signals";
import { data, idempotencyKey, type Job, ProblemError } from "../../../api/client";
import type { App } from "../../../app";
import { type Inspection, readInspections } from "../../../state/records/inspections";
import { hasEnded } from "../../../state/records/jobs";
import { Command, type Steps } from "../../../state/station/command";

export interface Part {
  serial: Signal<string>;
  order: Signal<string>;
}

/** The attribute of an inspection that names its operator in gauge R&R studies. */
const OPERATOR = "operator";

export class InspectionRun {
  readonly command = new Command((steps) => this.begin(steps));
  /** Inspects a part that was inspected before. */
  readonly again = new Command((steps) => this.inspect(steps));
  /** The newest inspection of the same serial number, while the operator is asked about it. */
  readonly repeated = signal<Inspection | undefined>(undefined);
  /** The newest inspection job. */
  readonly newest: ReadonlySignal<Job | undefined>;
  /** The newest inspection job, if it ended without a verdict. */
  readonly failed: ReadonlySignal<Job | undefined>;
  /** A request whose response was lost: repeated with the same key, it does not inspect the part twice. */
  private unanswered: { body: string; key: string } | undefined;

  constructor(
    private readonly app: Pick<App, "api" | "jobs">,
    private readonly part: Part,
    /** Reference to the recipe; undefined: by the rule on the serial number. */
    private readonly recipe: () => string | undefined,
    /** Name of the person who inspects; undefined: not known, and an operator stated by the recipe stays. */
    private readonly operator: () => string | undefined,
  ) {
    this.newest = computed(() => app.jobs.list.value.find((job) => job.kind === "inspection"));
    this.failed = computed(() => {
      const newest = this.newest.value;
      return newest && hasEnded(newest) && newest.state !== "succeeded" ? newest : undefined;
    });
  }

  get running(): boolean {
    return this.command.running || this.again.running;
  }

  private async begin(steps: Steps): Promise<void> {
    const [earlier] = (await readInspections(this.app.api, 1, { serial: this.serial })).items;
    if (earlier) this.repeated.value = earlier;
    else await this.inspect(steps);
  }

  private get serial(): string {
    return this.part.serial.peek().trim();
  }

  private async inspect(steps: Steps): Promise<void> {
    const { api, jobs } = this.app;
    const [recipe, order, operator] = [this.recipe(), this.part.order.peek().trim(), this.operator()];
    const body = {
      serial: this.serial,
      ...(recipe !== undefined && { recipe }),
      ...(order !== "" && { order }),
      ...(operator !== undefined && { attributes: { [OPERATOR]: operator } }),
    };
    const params = { header: { "Idempotency-Key": this.keyOf(JSON.stringify(body)) } };
    const job = await data(api.POST("/api/v1/inspections", { params, body })).catch((cause) => {
      // The server has decided: the next attempt is another request.
      if (cause instanceof ProblemError) this.unanswered = undefined;
      throw cause;
    });
    this.unanswered = undefined;
    this.repeated.value = undefined;
    // The next serial number can be scanned while this part is inspected.
    this.part.serial.value = "";
    steps.accepted();
    // Without `wait_s` the response is a job.
    if (!("state" in job)) return;
    jobs.update(job);
    await jobs.ended(job.id);
  }

  private keyOf(body: string): string {
    if (this.unanswered?.body !== body) this.unanswered = { body, key: idempotencyKey() };
    return this.unanswered.key;
  }
}
