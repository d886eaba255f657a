/** The scan and measurement settings of Operate: stored on the server, edited here, the same in every browser. */

import { signal } from "@preact/signals";
import { type Api, data, type Problem, problemOf, type Schemas } from "../../api/client";

export type Plan = Schemas["MeasurementPlanDto"];

/** Delay from the last keystroke until a change is sent, ms. */
const SEND_AFTER_MS = 400;

export class MeasurementPlan {
  /** The plan with local changes that are not saved yet. Undefined: not loaded yet. */
  readonly plan = signal<Plan | undefined>(undefined);
  /** Whether there are changes that the server has not stored yet. */
  readonly unsaved = signal(false);
  /** Why loading or saving failed. */
  readonly problem = signal<Problem | undefined>(undefined);
  private version = "*";
  private timer: ReturnType<typeof setTimeout> | undefined;
  private sending: Promise<void> | undefined;

  constructor(private readonly api: Api) {}

  /** Loads the plan, unless there are unsaved changes. */
  async load(): Promise<void> {
    if (this.unsaved.peek()) return;
    try {
      const answer = await this.api.GET("/api/v1/measurement-plan");
      const plan = await data(Promise.resolve(answer));
      if (this.unsaved.peek()) return;
      this.version = answer.response.headers.get("ETag") ?? "*";
      this.plan.value = plan;
      this.problem.value = undefined;
    } catch (cause) {
      this.problem.value = problemOf(cause);
    }
  }

  /** Applies a change locally and saves it after a pause in typing. */
  change(part: Partial<Plan>): void {
    const before = this.plan.peek();
    if (!before) return;
    this.plan.value = { ...before, ...part };
    this.unsaved.value = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.saved(), SEND_AFTER_MS);
  }

  /** Saves pending changes; resolves to whether the server has stored the plan. */
  async saved(): Promise<boolean> {
    clearTimeout(this.timer);
    await this.sending;
    if (this.unsaved.peek()) {
      this.sending = this.send();
      await this.sending;
      this.sending = undefined;
    }
    return this.problem.peek() === undefined;
  }

  private async send(): Promise<void> {
    const body = this.plan.peek();
    if (!body) return;
    try {
      const params = { header: { "If-Match": this.version } };
      const answer = await this.api.PUT("/api/v1/measurement-plan", { params, body });
      await data(Promise.resolve(answer));
      this.version = answer.response.headers.get("ETag") ?? "*";
      this.problem.value = undefined;
      if (this.plan.peek() === body) this.unsaved.value = false;
    } catch (cause) {
      const problem = problemOf(cause);
      // Changed by someone else in the meantime: show the new plan, and the problem that this change was not saved.
      if (problem.status === 412) {
        this.unsaved.value = false;
        await this.load();
      }
      this.problem.value = problem;
    }
  }
}
