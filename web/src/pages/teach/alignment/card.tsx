/** The alignment of the part: three datums, whose frame is that of all other regions and of coordinates. */

import { useMemo } from "preact/hooks";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Choice } from "../../../components/fields/choice";
import { ReasonedButton } from "../../../components/reasoned_button";
import { text } from "../../../text";
import type { TeachState } from "../teach_state";
import { boundToFrame, DATUMS } from "./datums";
import { AlignmentDraft } from "./draft";

export function AlignmentCard({ state }: { state: TeachState }) {
  const { api } = useApp();
  const words = text.value.teach;
  const draft = useMemo(() => new AlignmentDraft(api, state), [api, state]);
  return (
    <details class="card alignment">
      <summary>{words.alignment}</summary>
      <div class="stack">
        <p class="muted">{words.alignment_hint}</p>
        {state.plan.value.alignment ? (
          <Aligned state={state} draft={draft} />
        ) : (
          <Datums state={state} draft={draft} />
        )}
      </div>
    </details>
  );
}

interface Properties {
  state: TeachState;
  draft: AlignmentDraft;
}

function Datums({ state, draft }: Properties) {
  const words = text.value.teach;
  const { value: chosen } = draft.chosen;
  const options = ["", ...draft.offered.value].map((id) => [id, id] as const);
  return (
    <div class="row end">
      {DATUMS.map((datum) => (
        <Choice
          key={datum}
          label={words.datums[datum]}
          value={chosen[datum]}
          options={options}
          onChange={(id) => (draft.chosen.value = { ...chosen, [datum]: id })}
        />
      ))}
      <CommandButton command={draft.align} blocked={blockedAlign(state, draft)}>
        {words.align}
      </CommandButton>
    </div>
  );
}

/** Why the part cannot be aligned now. */
function blockedAlign({ scan, plan }: TeachState, draft: AlignmentDraft): string | undefined {
  const words = text.value.teach;
  if (!scan.cloud) return words.no_cloud;
  const bound = boundToFrame(plan.value);
  if (bound.length > 0) return words.bound_to_scan(bound.join(", "));
  return draft.fault.value && words.datum_faults[draft.fault.value];
}

function Aligned({ state, draft }: Properties) {
  const words = text.value.teach;
  const { alignment } = state.plan.value;
  const bound = boundToFrame(state.plan.value);
  const blocked = bound.length > 0 ? words.bound_to_datums(bound.join(", ")) : state.pose_blocked.value;
  return (
    <>
      <dl class="facts" data-aligned>
        {DATUMS.map((datum) => [
          <dt key={datum}>{words.datums[datum]}</dt>,
          <dd key={`${datum}-id`} class="mono">
            {alignment?.[datum]}
          </dd>,
        ])}
      </dl>
      <ReasonedButton label={words.unalign} blocked={blocked} onClick={() => draft.remove()} />
    </>
  );
}
