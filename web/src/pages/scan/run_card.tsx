/** The running scan, or the outcome of the last one. */

import type { Job } from "../../api/client";
import { CommandButton } from "../../components/command_button";
import { problemOfJob } from "../../components/job/job_problem";
import { JobProgress } from "../../components/job/job_progress";
import { JobText } from "../../components/job/job_text";
import { ProblemCard } from "../../components/problem";
import { useHalted } from "../../components/station/halted";
import { href } from "../../state/browser/route";
import { hasEnded } from "../../state/records/jobs";
import { language, text } from "../../text";
import { count, dateTime } from "../../units";
import type { ScanRun } from "./scan_run";

export function RunCard({ run }: { run: ScanRun }) {
  const job = run.job.value;
  const words = text.value.scan;
  if (!job) return null;
  return (
    <section class="card run" aria-label={words.run} data-scan-state={job.state}>
      {hasEnded(job) ? <Ended run={run} job={job} /> : <Running run={run} job={job} />}
      {run.problem.value && <ProblemCard problem={run.problem.value} />}
    </section>
  );
}

function Running({ run, job }: { run: ScanRun; job: Job }) {
  const words = text.value.scan;
  const lost = run.lost.value.filter(([, n]) => n > 0);
  const losses = lost.map(
    ([reason, n]) => `${text.value.drop_reasons[reason] ?? reason}: ${count(n, language.value)}`,
  );
  return (
    <>
      <h2>{words.running}</h2>
      <JobProgress job={job} />
      <p class={lost.length > 0 ? "problem" : "muted"} data-lost={lost.length}>
        {lost.length > 0 ? words.lost(losses.join(", ")) : words.nothing_lost}
      </p>
    </>
  );
}

function Ended({ run, job }: { run: ScanRun; job: Job }) {
  const words = text.value.scan;
  const partial = run.partial.value;
  const halted = useHalted();
  const invalid = run.scan.value?.state === "invalid";
  const result_id = job.result?.id ?? partial?.id;
  return (
    <>
      <h2>
        {words.ended[job.state]} <small class="muted">{dateTime(job.ended_at_ms, language.value)}</small>
      </h2>
      <p>
        <JobText job={job} />
      </p>
      {job.state === "failed" && job.problem != null && <ProblemCard problem={problemOfJob(job)} />}
      {invalid && (
        <p class="problem" data-worth="invalid">
          <strong>✕ {text.value.outcomes.invalid}</strong> {text.value.result.state_hints.invalid}
        </p>
      )}
      {partial && (
        <p class="note">
          {words.partial} {words.kept_rows(count(partial.report.n_frames, language.value))}
        </p>
      )}
      <div class="row">
        {partial && (
          <CommandButton command={run.resume} kind="primary" blocked={halted}>
            {words.resume}
          </CommandButton>
        )}
        {job.result && (
          <a class="button primary-link" href={href("result", job.result.id)}>
            {words.show_result}
          </a>
        )}
        {!job.result && result_id && (
          <a class="button" href={href("result", result_id)}>
            {words.show_partial}
          </a>
        )}
      </div>
    </>
  );
}
