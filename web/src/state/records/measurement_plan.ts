/** What Start scans and measures: kept by the server, edited here, the same in every browser. */

import { signal } from "@preact/signals";
import { type Api, data, type Problem, problemOf, type Schemas } from "../../api/client";

export type Plan = Schemas["MeasurementPlanDto"];

/** Time after the last keystroke until a change is sent: a number is typed within it. */
const SEND_AFTER_MS = 400;

export class MeasurementPlan {
  /** As shown: the server's, with changes on their way to it. Undefined: not read yet. */
  readonly plan = signal<Plan | undefined>(undefined);
  /** Whether a change is not yet kept by the server. */
  readonly unsaved = signal(false);
  /** Why it was not read or not kept. */
  readonly problem = signal<Problem | undefined>(undefined);
  private version = "*";
  private timer: ReturnType<typeof setTimeout> | undefined;
  private sending: Promise<void> | undefined;

  constructor(private readonly api: Api) {}

  /** Reads the plan, unless it is being changed here. */
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

  /** Shows the change at once and sends it after a pause in typing. */
  change(part: Partial<Plan>): void {
    const before = this.plan.peek();
    if (!before) return;
    this.plan.value = { ...before, ...part };
    this.unsaved.value = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.saved(), SEND_AFTER_MS);
  }

  /** Resolves when the server has what is shown; false where it refused. */
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
      // Somebody else changed it meanwhile: theirs is shown, with the word that this one was not kept.
      if (problem.status === 412) {
        this.unsaved.value = false;
        await this.load();
      }
      this.problem.value = problem;
    }
  }
}
