/** Hold and resume of the queue of inspections: no further part starts, from whichever source. */

import { useMemo } from "preact/hooks";
import type { Problem, Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { actorName } from "../../../components/actor";
import { CommandButton } from "../../../components/command_button";
import { TextField } from "../../../components/fields/text_field";
import { ProblemCard } from "../../../components/problem";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { LONGEST_REASON, QueueCommands } from "./queue_commands";

interface Properties {
  /** Undefined: not known yet. */
  hold: Schemas["InspectionQueueDto"] | undefined;
  problem: Problem | undefined;
  reload: () => Promise<void>;
}

export function QueueHold({ hold, problem, reload }: Properties) {
  const { api, jobs } = useApp();
  const words = text.value.operate;
  const queue = useMemo(() => new QueueCommands(api, reload), [api]);
  if (problem) return <ProblemCard problem={problem} />;
  if (!hold) return null;
  const n_waiting = jobs.open.value.filter(
    ({ kind, state }) => kind === "inspection" && state === "queued",
  ).length;
  return (
    <div class={`queue-hold row ${hold.held ? "note" : ""}`} data-held={hold.held}>
      <p class="grow" role="status">
        <strong>{hold.held ? words.held : words.not_held}</strong>
        {hold.held && (
          <>
            {" "}
            {words.held_by(hold.held_by ? actorName(hold.held_by) : "–", dateTime(hold.since_ms, language.value))}
          </>
        )}{" "}
        {words.n_waiting(n_waiting)}
        {hold.reason && <span class="reason">{words.held_because(hold.reason)}</span>}
      </p>
      {hold.held ? (
        <CommandButton command={queue.resume} kind="operator">
          {words.resume_queue}
        </CommandButton>
      ) : (
        <>
          <Reason queue={queue} />
          <CommandButton command={queue.hold} kind="operator">
            {words.hold_queue}
          </CommandButton>
        </>
      )}
    </div>
  );
}

/** The reason for a hold; optional, so that holding remains one press. */
function Reason({ queue }: { queue: QueueCommands }) {
  return (
    <TextField
      label={text.value.operate.hold_reason}
      value={queue.reason.value}
      maxLength={LONGEST_REASON}
      placeholder={text.value.common.optional}
      onChange={(reason) => (queue.reason.value = reason)}
      onKeyDown={(event) => {
        if (event.key === "Enter") void queue.hold.start();
      }}
    />
  );
}
