/** What a job does, or how it ended, in the chosen language. The server says it in English, and by names. */

import type { Job, Station } from "../../api/client";
import { hasEnded } from "../../state/records/jobs";
import { language, text } from "../../text";

/** In one line. */
export function jobText(job: Job): string {
  if (language.value === "en") return job.message;
  const words = text.value.jobs;
  if (job.state === "queued") return words.waits;
  if (job.state === "succeeded") return words.made[job.kind] ?? words.states.succeeded;
  if (job.state !== "running") return words.ended[job.state];
  const { phase, number, total } = job.step ?? {};
  // A phase of a newer server has no text here.
  const doing = (phase && words.phases[phase]) ?? words.states.running;
  return number != null && total != null ? words.counted(doing, number, total) : doing;
}

/** With the server message below, which may have more detail. */
export function JobText({ job }: { job: Job }) {
  const more = language.value !== "en" && hasEnded(job) && job.message !== job.state;
  return (
    <>
      {jobText(job)}
      {more && (
        <small class="own-words" lang="en">
          {job.message}
        </small>
      )}
    </>
  );
}

/** Current activity of the station, in the chosen language if available; `job`: the one that uses the station. */
export function activityOf(status: Station, job: Job | undefined): string {
  if (language.value === "en") return status.activity;
  return job ? jobText(job) : text.value.frame.by_job;
}
