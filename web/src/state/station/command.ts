/** A user command with its phase: requested → accepted → done or failed. */

import { type ReadonlySignal, signal } from "@preact/signals";
import { type Problem, problemOf } from "../../api/client";

export type Phase = "idle" | "requested" | "accepted" | "done" | "failed";

/** Progress of a command. */
export interface Steps {
  /** The server accepted it; the action continues. */
  accepted(): void;
}

export class Command<Arguments extends unknown[] = []> {
  private readonly phase_ = signal<Phase>("idle");
  private readonly problem_ = signal<Problem | undefined>(undefined);

  constructor(private readonly procedure: (steps: Steps, ...args: Arguments) => Promise<void>) {}

  get phase(): ReadonlySignal<Phase> {
    return this.phase_;
  }

  /** Why it failed. */
  get problem(): ReadonlySignal<Problem | undefined> {
    return this.problem_;
  }

  get running(): boolean {
    return this.phase_.value === "requested" || this.phase_.value === "accepted";
  }

  /** Runs the command; ignored while it is already running. */
  async start(...args: Arguments): Promise<boolean> {
    if (this.phase_.peek() === "requested" || this.phase_.peek() === "accepted") return false;
    this.problem_.value = undefined;
    this.phase_.value = "requested";
    try {
      await this.procedure({ accepted: () => (this.phase_.value = "accepted") }, ...args);
      this.phase_.value = "done";
      return true;
    } catch (cause) {
      this.problem_.value = problemOf(cause);
      this.phase_.value = "failed";
      return false;
    }
  }

  /** Dismisses the problem. */
  dismiss(): void {
    this.problem_.value = undefined;
    if (this.phase_.value === "failed") this.phase_.value = "idle";
  }
}
