/** Progress of the running job in large type. */

import type { Job } from "../../api/client";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { remaining, useCancel } from "../../components/job/job_progress";
import { jobText } from "../../components/job/job_text";
import { nameOf } from "../../state/records/jobs";
import { language, text } from "../../text";
import { decimal } from "../../units";

export function RunProgress({ job }: { job: Job }) {
  const app = useApp();
  const cancel = useCancel(app, job);
  const words = text.value;
  const name = nameOf(job);
  return (
    <div class="stack run-progress live-data" data-job-state={job.state}>
      <p class="percent">
        <span class="big number">{decimal(100 * job.progress, 0, language.value)} %</span>
        <strong>
          {words.jobs.kinds[job.kind] ?? job.kind}
          {name && ` · ${name}`}
        </strong>
      </p>
      <progress value={job.progress} max={1} aria-label={words.operate.progress} />
      {job.state !== "queued" && <p class="number">{remaining(job)}</p>}
      <p class="muted">{jobText(job)}</p>
      <CommandButton command={cancel} kind="operator">
        {words.common.cancel}
      </CommandButton>
    </div>
  );
}
