/** Activity or outcome of a job in the chosen language. The server sends English messages and codes. */

import type { Job, Station } from "../../api/client";
import { hasEnded } from "../../state/records/jobs";
import { language, text } from "../../text";

/** The job's state as one line. */
export function jobText(job: Job): string {
  if (language.value === "en") return job.message;
  const words = text.value.jobs;
  if (job.state === "queued") return words.waits;
  if (job.state === "succeeded") return words.made[job.kind] ?? words.states.succeeded;
  if (job.state !== "running") return words.ended[job.state];
  const { phase, number, total } = job.step ?? {};
  // A phase unknown to this version of the page has no translation.
  const doing = (phase && words.phases[phase]) ?? words.states.running;
  return number != null && total != null ? words.counted(doing, number, total) : doing;
}

/** The job's state, with the server message below, which may have more detail. */
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
