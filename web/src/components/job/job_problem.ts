/** The result of a job, or the problem it ended with. */

import { type Job, type Problem, ProblemError } from "../../api/client";
import { text } from "../../text";

/** Why a job ended without a result. */
export function problemOfJob(job: Job): Problem {
  if (job.problem) return job.problem;
  return {
    type: "urn:sheaf:problem:job",
    title: text.value.jobs.states[job.state],
    status: 0,
    detail: job.message,
  };
}

/** The id of the job's result; throws the job's problem if it has none. */
export function succeeded(job: Job): string {
  if (job.state === "succeeded" && job.result) return job.result.id;
  throw new ProblemError(problemOfJob(job));
}
