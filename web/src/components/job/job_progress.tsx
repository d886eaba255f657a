/** A waiting or running job: activity, progress, remaining time, cancel button. */

import { useMemo } from "preact/hooks";
import { data, type Job } from "../../api/client";
import { type App, useApp } from "../../app";
import { hasEnded } from "../../state/records/jobs";
import { Command } from "../../state/station/command";
import { language, text } from "../../text";
import { duration } from "../../units";
import { CommandButton } from "../command_button";
import { jobText } from "./job_text";

/** The command that cancels a job. */
export function useCancel({ api, jobs }: Pick<App, "api" | "jobs">, job: Job): Command {
  return useMemo(
    () =>
      new Command(async (steps) => {
        const params = { path: { id: job.id } };
        jobs.update(await data(api.POST("/api/v1/jobs/{id}/cancel", { params })));
        steps.accepted();
        await jobs.ended(job.id);
      }),
    [api, jobs, job.id],
  );
}

export function JobProgress({ job }: { job: Job }) {
  const cancel = useCancel(useApp(), job);
  return (
    <div class="stack job" data-job-state={job.state}>
      <progress value={job.progress} max={1} aria-label={jobText(job)} />
      <div class="row">
        <span class="grow">
          {jobText(job)} <span class="muted number">{remaining(job)}</span>
        </span>
        {!hasEnded(job) && <CommandButton command={cancel}>{text.value.common.cancel}</CommandButton>}
      </div>
    </div>
  );
}

/** Remaining time and expected end. */
export function remaining(job: Job): string {
  if (job.remaining_s == null || hasEnded(job)) return "";
  const ends = new Date(Date.now() + 1000 * job.remaining_s);
  const clock = ends.toLocaleTimeString(language.value, { hour: "2-digit", minute: "2-digit", hourCycle: "h23" });
  const words = text.value.common;
  return `${words.remaining(duration(job.remaining_s, language.value))}, ${words.ends_at(clock)}`;
}
