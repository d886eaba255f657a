/** Hold and resume of the queue of inspections: no further part starts, from whichever source. */

import { useMemo } from "preact/hooks";
import { data, type Problem, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { ProblemCard } from "../../../components/problem";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";

interface Properties {
  /** Undefined: not known yet. */
  hold: Schemas["InspectionQueueDto"] | undefined;
  problem: Problem | undefined;
  reload: () => Promise<void>;
}

export function QueueHold({ hold, problem, reload }: Properties) {
  const { api, jobs } = useApp();
  const words = text.value.operate;
  const [pause, resume] = useMemo(
    () => [
      new Command(async () => {
        await data(api.POST("/api/v1/inspection-queue/hold", { body: {} }));
        await reload();
      }),
      new Command(async () => {
        await data(api.POST("/api/v1/inspection-queue/resume"));
        await reload();
      }),
    ],
    [api],
  );
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
            {words.held_by(hold.held_by ?? "–", dateTime(hold.since_ms, language.value))}
            {hold.reason && <span> {hold.reason}</span>}
          </>
        )}{" "}
        {words.n_waiting(n_waiting)}
      </p>
      {hold.held ? (
        <CommandButton command={resume} kind="operator">
          {words.resume_queue}
        </CommandButton>
      ) : (
        <CommandButton command={pause} kind="operator">
          {words.hold_queue}
        </CommandButton>
      )}
    </div>
  );
}
