/** Serial number, Start with the reason if it is blocked; progress while a job is running. */

import type { ReadonlySignal, Signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, type Job } from "../../api/client";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { problemOfJob } from "../../components/job/job_problem";
import { ProblemCard } from "../../components/problem";
import { ResetButton } from "../../components/reset";
import { href } from "../../state/browser/route";
import { Command } from "../../state/station/command";
import { text } from "../../text";
import type { Operation } from "./operation";
import { type Obstacle, REMEDY_PAGE } from "./readiness";
import { RunProgress } from "./run_progress";
import { SerialField } from "./serial_field";

interface Properties {
  operation: Operation;
  serial: Signal<string>;
  obstacle: Obstacle | undefined;
  /** Error message of the settings form. */
  wrong: string | undefined;
  job: Job | undefined;
}

export function Start({ operation, serial, obstacle, wrong, job }: Properties) {
  const words = text.value.operate;
  const blocked = obstacle ? words.obstacles[obstacle] : wrong;
  const begin = () => {
    if (blocked || operation.command.running) return false;
    void operation.command.start();
    return true;
  };
  return (
    <section class="card stack operate-start" aria-label={words.title}>
      <SerialField serial={serial} placeholder={words.serial_placeholder} onEnter={begin} />
      {job ? (
        <RunProgress job={job} />
      ) : (
        <>
          <CommandButton command={operation.command} blocked={blocked} kind="primary operator">
            {words.start}
          </CommandButton>
          {obstacle && <Remedy obstacle={obstacle} />}
        </>
      )}
      <Ended failed={operation.failed} />
    </section>
  );
}

/** What removes an obstacle: a command, or the page for it. */
export function Remedy({ obstacle }: { obstacle: Obstacle }) {
  const { api, control } = useApp();
  const words = text.value.operate;
  const page = REMEDY_PAGE[obstacle];
  const home = useMemo(
    () =>
      new Command(async () => {
        await control.ensure();
        const params = { header: { "Sheaf-Control": control.id() ?? "" } };
        await data(api.POST("/api/v1/devices/stage/home", { params }));
      }),
    [api, control],
  );
  if (obstacle === "halted") return <ResetButton label={text.value.frame.reset_stop} kind="operator" />;
  if (obstacle === "fault") return <ResetButton label={text.value.frame.reset} kind="operator" />;
  if (obstacle === "not_homed") {
    return (
      <CommandButton command={home} kind="operator">
        {words.home}
      </CommandButton>
    );
  }
  if (!page) return null;
  return (
    <a class="button operator" href={href(page)}>
      {words.remedies[obstacle]}
    </a>
  );
}

/** The problem of the last scan if it has no result. */
export function Ended({ failed }: { failed: ReadonlySignal<Job | undefined> }) {
  const job = failed.value;
  if (!job) return null;
  const words = text.value;
  const title = words.jobs.states[job.state];
  if (job.state === "cancelled") {
    return (
      <p class="muted">
        {words.jobs.kinds[job.kind] ?? job.kind}: {title}
      </p>
    );
  }
  return (
    <ProblemCard
      problem={{
        ...problemOfJob(job),
        type: "about:blank",
        title: `${words.jobs.kinds[job.kind] ?? job.kind}: ${title}`,
      }}
    />
  );
}
