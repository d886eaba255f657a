/** A job that waits or runs: what it does, how far it is, how long it takes, and the way to end it. */

import { useMemo } from "preact/hooks";
import { data, type Job } from "../api/client";
import { useApp } from "../app";
import { Command } from "../state/command";
import { hasEnded } from "../state/jobs";
import { language, text } from "../text";
import { duration } from "../units";
import { CommandButton } from "./command_button";

export function JobProgress({ job }: { job: Job }) {
  const { api, jobs } = useApp();
  const cancel = useMemo(
    () =>
      new Command(async (steps) => {
        jobs.note(await data(api.POST("/api/v1/jobs/{id}/cancel", { params: { path: { id: job.id } } })));
        steps.accepted();
        await jobs.ended(job.id);
      }),
    [api, jobs, job.id],
  );
  return (
    <div class="stack job" data-job-state={job.state}>
      <progress value={job.progress} max={1} aria-label={job.message} />
      <div class="row">
        <span class="grow">
          {job.message} <span class="muted number">{remaining(job)}</span>
        </span>
        {!hasEnded(job) && <CommandButton command={cancel}>{text.value.parts.cancel}</CommandButton>}
      </div>
    </div>
  );
}

/** Time left and the time of day when it ends. */
function remaining(job: Job): string {
  if (job.remaining_s == null || hasEnded(job)) return "";
  const ends = new Date(Date.now() + 1000 * job.remaining_s);
  const clock = ends.toLocaleTimeString(language.value, { hour: "2-digit", minute: "2-digit" });
  const words = text.value.parts;
  return `${words.remaining(duration(job.remaining_s, language.value))}, ${words.ends_at(clock)}`;
}
