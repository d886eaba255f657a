/** Finished jobs, newest first, with the problem of failed ones. */

import type { Job } from "../../api/client";
import { actorName } from "../../components/actor";
import { problemOfJob } from "../../components/job/job_problem";
import { JobText } from "../../components/job/job_text";
import { ProblemCard } from "../../components/problem";
import { nameOf } from "../../state/records/jobs";
import { language, text } from "../../text";
import { dateTime, duration } from "../../units";
import { kindOf, resultUrl, runTime_s } from "./job_facts";

export function Ended({ jobs }: { jobs: readonly Job[] }) {
  const words = text.value.jobs;
  return (
    <section class="card" aria-label={words.history}>
      <h2>{words.history}</h2>
      {jobs.length === 0 ? (
        <p class="muted">{words.no_history}</p>
      ) : (
        <table class="wide">
          <thead>
            <tr>
              <th>{words.job}</th>
              <th>{words.state}</th>
              <th>{words.outcome}</th>
              <th>{words.source}</th>
              <th>{words.when}</th>
              <th class="number">{words.took}</th>
            </tr>
          </thead>
          <tbody>
            {jobs.map((job) => (
              <Row key={job.id} job={job} />
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}

function Row({ job }: { job: Job }) {
  const words = text.value.jobs;
  const result_url = resultUrl(job);
  const bad = job.state === "failed" || job.state === "interrupted";
  return (
    <tr data-job-state={job.state}>
      <td>
        <strong>{kindOf(job)}</strong>
        {nameOf(job) && <div>{nameOf(job)}</div>}
      </td>
      <td data-label={words.state}>
        <span class={bad ? "tag bad" : "tag"}>
          {bad && "✕ "}
          {words.states[job.state]}
        </span>
      </td>
      <td data-label={words.outcome}>
        {bad && job.problem ? <ProblemCard problem={problemOfJob(job)} /> : <JobText job={job} />}
        {result_url && (
          <div>
            <a href={result_url}>{words.open[job.result?.kind ?? ""] ?? words.open_other}</a>
          </div>
        )}
      </td>
      <td data-label={words.source}>{actorName(job.source)}</td>
      <td data-label={words.when} class="nowrap">
        {dateTime(job.created_at_ms, language.value)}
      </td>
      <td data-label={words.took} class="number nowrap">
        {duration(runTime_s(job), language.value)}
      </td>
    </tr>
  );
}
