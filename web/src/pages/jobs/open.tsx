/** A waiting or running job. */

import type { Job } from "../../api/client";
import { actorName } from "../../components/actor";
import { JobProgress } from "../../components/job/job_progress";
import { nameOf } from "../../state/records/jobs";
import { language, text } from "../../text";
import { dateTime } from "../../units";
import { kindOf } from "./job_facts";

export function Open({ job }: { job: Job }) {
  const words = text.value.jobs;
  return (
    <li class="open-job live-data">
      <div class="row">
        <strong>{kindOf(job)}</strong>
        {nameOf(job) && <span>{nameOf(job)}</span>}
        <span class="tag">{words.states[job.state]}</span>
        <span class="muted grow">
          {actorName(job.source)}, {dateTime(job.created_at_ms, language.value)}
        </span>
      </div>
      <JobProgress job={job} />
    </li>
  );
}
