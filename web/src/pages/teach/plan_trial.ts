/** What an inspection with a plan would say about the scan, from the server. Only the newest plan counts. */

import { computed, type ReadonlySignal, signal } from "@preact/signals";
import { type Api, data, type Problem, problemOf } from "../../api/client";
import type { Evaluation, Plan } from "./draft";

/** A plan with its answer. */
export interface Answered {
  plan: Plan;
  said: Evaluation;
}

export class PlanTrial {
  private readonly answered_ = signal<Answered | undefined>(undefined);
  /** The plan of the newest answer with its results. */
  readonly compared = computed(() => {
    const { plan, said } = this.answered_.value ?? {};
    return plan && said && { plan, results: said.results };
  });
  private readonly running_ = signal(false);
  private readonly problem_ = signal<Problem | undefined>(undefined);
  private request: AbortController | undefined;

  constructor(
    private readonly api: Api,
    private readonly scan_id: string,
  ) {}

  /** The newest answer; it may be that of an earlier plan. */
  get answered(): ReadonlySignal<Answered | undefined> {
    return this.answered_;
  }

  get running(): ReadonlySignal<boolean> {
    return this.running_;
  }

  /** Why the newest plan could not be evaluated. */
  get problem(): ReadonlySignal<Problem | undefined> {
    return this.problem_;
  }

  /** Evaluates a plan; an earlier request is cancelled. */
  async evaluate(plan: Plan): Promise<void> {
    this.cancel();
    const request = new AbortController();
    this.request = request;
    this.running_.value = true;
    const params = { path: { id: this.scan_id } };
    try {
      const { signal } = request;
      const said = await data(this.api.POST("/api/v1/scans/{id}/evaluate", { params, body: { plan }, signal }));
      if (this.request === request) this.answered_.value = { plan, said };
    } catch (cause) {
      if (this.request === request) this.problem_.value = problemOf(cause);
    } finally {
      if (this.request === request) this.running_.value = false;
    }
  }

  /** Cancels the request, if one is open. */
  cancel(): void {
    this.request?.abort();
    this.request = undefined;
    this.running_.value = false;
    this.problem_.value = undefined;
  }

  /** Forgets the answer: there is nothing to evaluate. */
  clear(): void {
    this.cancel();
    this.answered_.value = undefined;
  }
}
