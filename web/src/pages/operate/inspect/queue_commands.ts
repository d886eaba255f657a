/** The commands of the inspection queue, and the reason typed for its next hold. */

import { signal } from "@preact/signals";
import { type Api, data } from "../../../api/client";
import { Command } from "../../../state/station/command";

/** Longest reason that the server accepts. */
export const LONGEST_REASON = 100;

export class QueueCommands {
  /** As typed; empty: none. */
  readonly reason = signal("");
  readonly hold = new Command(() => this.holdQueue());
  readonly resume = new Command(async () => {
    await data(this.api.POST("/api/v1/inspection-queue/resume"));
    await this.reload();
  });

  constructor(
    private readonly api: Api,
    private readonly reload: () => Promise<void>,
  ) {}

  private async holdQueue(): Promise<void> {
    const reason = this.reason.peek().trim();
    await data(this.api.POST("/api/v1/inspection-queue/hold", { body: reason === "" ? {} : { reason } }));
    // The next hold has another reason.
    this.reason.value = "";
    await this.reload();
  }
}
