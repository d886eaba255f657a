/** What Start does: scan, wait, measure. */

import { computed, type ReadonlySignal, type Signal, signal } from "@preact/signals";
import { data, idempotencyKey, type Job } from "../../api/client";
import type { App } from "../../app";
import { Command, type Steps } from "../../state/command";
import { hasEnded } from "../../state/jobs";
import { measurementOf, type Recipe, scanOf } from "./recipe";

export class Operation {
  readonly command = new Command((steps) => this.run(steps));
  /** Whether the measurement is being taken. */
  readonly measuring = signal(false);
  /** The newest scan job, if it ended without a result. */
  readonly failed: ReadonlySignal<Job | undefined>;

  constructor(
    private readonly app: Pick<App, "api" | "jobs">,
    private readonly serial: Signal<string>,
    private readonly recipe: () => Recipe,
  ) {
    this.failed = computed(() => {
      const newest = app.jobs.list.value.find((job) => job.kind === "scan");
      return newest && hasEnded(newest) && newest.state !== "succeeded" ? newest : undefined;
    });
  }

  private async run(steps: Steps): Promise<void> {
    const { api, jobs } = this.app;
    const recipe = this.recipe();
    const body = scanOf(recipe, this.serial.peek());
    const params = { header: { "Idempotency-Key": idempotencyKey() } };
    const job = (await data(api.POST("/api/v1/scans", { params, body }))) as Job;
    jobs.note(job);
    // The next part may be read while this one is scanned.
    this.serial.value = "";
    steps.accepted();
    const ended = await jobs.ended(job.id);
    const scan_id = ended.result?.id;
    const measurement = measurementOf(recipe);
    // A stopped or lossy scan gets no verdict; how the job ended is shown from the job itself.
    if (ended.state !== "succeeded" || !scan_id || !measurement) return;
    this.measuring.value = true;
    try {
      const path = { id: scan_id };
      await data(api.POST("/api/v1/scans/{id}/measurements", { params: { path }, body: measurement }));
    } finally {
      this.measuring.value = false;
    }
  }
}
