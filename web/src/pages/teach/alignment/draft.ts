/** The datums that are chosen, and the command that aligns the plan by them. */

import { computed, signal } from "@preact/signals";
import { type Api, data, ProblemError } from "../../../api/client";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { ANY, candidates } from "../composed";
import type { TeachState } from "../teach_state";
import { datumsFault, NO_DATUMS } from "./datums";
import { type Alignment, hasDatums } from "./frame";

export class AlignmentDraft {
  readonly chosen = signal<Alignment>(NO_DATUMS);
  /** Ids of the features that can be datums. */
  readonly offered = computed(() => candidates(this.state.plan.value, { name: "datum", kinds: ANY }));
  readonly fault = computed(() => datumsFault(this.chosen.value, this.offered.value));
  readonly align: Command;

  constructor(
    private readonly api: Api,
    private readonly state: TeachState,
  ) {
    this.align = new Command(() => this.alignPlan());
  }

  /** Removes the alignment; its datums stay chosen, so that one of them can be changed. */
  remove(): void {
    const { alignment } = this.state.plan.peek();
    if (alignment) this.chosen.value = alignment;
    this.state.unalign();
  }

  /** Finds the datum frame on the scan, and aligns the plan if there is one. */
  private async alignPlan(): Promise<void> {
    const [plan, alignment] = [this.state.plan.peek(), this.chosen.peek()];
    const params = { path: { id: this.state.scan.id } };
    // What is measured has no say in where the datums are.
    const body = { plan: { ...plan, alignment, characteristics: [] } };
    const said = await data(this.api.POST("/api/v1/scans/{id}/evaluate", { params, body }));
    if (!said.datum_from_part) {
      const detail = said.alignment_failure ?? "";
      throw new ProblemError({ type: "about:blank", title: text.value.inspections.no_datum, status: 0, detail });
    }
    // Another recipe may have been chosen meanwhile.
    const now = this.state.plan.peek();
    if (!now.alignment && hasDatums(plan, alignment, now)) this.state.align(alignment, said.datum_from_part);
  }
}
