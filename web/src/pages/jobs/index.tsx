/** The jobs page: waiting, running and finished jobs. */

import { useMemo } from "preact/hooks";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { CopyLine } from "../../components/copy_line";
import { DamagedRecords } from "../../components/dialogs/damaged";
import { hasEnded } from "../../state/records/jobs";
import { Command } from "../../state/station/command";
import { text } from "../../text";
import { Ended } from "./ended";
import { Open } from "./open";
import "./jobs.css";

export default function Jobs() {
  const { jobs } = useApp();
  const words = text.value.jobs;
  const open = jobs.open.value;
  const ended = jobs.list.value.filter(hasEnded);
  return (
    <div class="stack jobs">
      <h1>{words.title}</h1>
      <DamagedRecords rows={jobs.damaged.value} />
      <section class="card" aria-label={words.queue}>
        <h2>{words.queue}</h2>
        {open.length === 0 && <p class="muted">{words.nothing_waits}</p>}
        <ul class="plain stack">
          {open.map((job) => (
            <Open key={job.id} job={job} />
          ))}
        </ul>
      </section>
      {jobs.list.value.length === 0 ? <First /> : <Ended jobs={ended} />}
      {jobs.has_older.value && <More />}
    </div>
  );
}

/** The empty state: the command that starts a first job through the API. */
function First() {
  const words = text.value.jobs;
  const line = `curl -X POST ${location.origin}/api/v1/calibrations -H 'Content-Type: application/json' -d '{"source": {"kind": "station"}}'`;
  return (
    <section class="card">
      <h2>{words.none_yet}</h2>
      <p>{words.first_by_page}</p>
      <p>{words.first_by_program}</p>
      <CopyLine line={line} />
      <p>
        <a href="/docs/">{text.value.common.api_explorer}</a>
      </p>
    </section>
  );
}

function More() {
  const { jobs } = useApp();
  const older = useMemo(() => new Command(() => jobs.older()), [jobs]);
  return <CommandButton command={older}>{text.value.jobs.older}</CommandButton>;
}
