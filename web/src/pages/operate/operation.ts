/** The command of Start: scans and measures in one job of the server. */

import { computed, type ReadonlySignal, type Signal } from "@preact/signals";
import { data, idempotencyKey, type Job } from "../../api/client";
import type { App } from "../../app";
import { hasEnded } from "../../state/records/jobs";
import type { MeasurementPlan } from "../../state/records/measurement_plan";
import { Command, type Steps } from "../../state/station/command";
import { scanOf } from "./plan";

export class Operation {
  readonly command = new Command((steps) => this.run(steps));
  /** The newest scan job. */
  readonly newest: ReadonlySignal<Job | undefined>;
  /** The newest scan job, if it ended without a result. */
  readonly failed: ReadonlySignal<Job | undefined>;

  constructor(
    private readonly app: Pick<App, "api" | "jobs">,
    private readonly serial: Signal<string>,
    private readonly plan: MeasurementPlan,
  ) {
    this.newest = computed(() => app.jobs.list.value.find((job) => job.kind === "scan"));
    this.failed = computed(() => {
      const newest = this.newest.value;
      return newest && hasEnded(newest) && newest.state !== "succeeded" ? newest : undefined;
    });
  }

  private async run(steps: Steps): Promise<void> {
    const { api, jobs } = this.app;
    const kept = await this.plan.saved();
    const plan = this.plan.plan.peek();
    // The problem is shown beside the plan.
    if (!kept || !plan) return;
    const body = scanOf(plan, this.serial.peek());
    const params = { header: { "Idempotency-Key": idempotencyKey() } };
    const job = await data(api.POST("/api/v1/scans", { params, body }));
    jobs.update(job);
    // The next serial number can be entered while this part is scanned.
    this.serial.value = "";
    steps.accepted();
    await jobs.ended(job.id);
  }
}
