/** Serial number, Start with the reason if it is blocked; progress while a job is running. */

import type { ReadonlySignal, Signal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
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
  const field = useRef<HTMLInputElement>(null);
  useEffect(() => focusOnTyping(field.current), []);
  const blocked = obstacle ? words.obstacles[obstacle] : wrong;
  const begin = () => {
    if (!blocked && !operation.command.running) void operation.command.start();
  };
  return (
    <section class="card stack operate-start" aria-label={words.title}>
      <div class="field">
        <label for="serial">{words.serial}</label>
        <input
          id="serial"
          ref={field}
          class="serial"
          value={serial.value}
          maxLength={100}
          autoComplete="off"
          autoCapitalize="characters"
          spellcheck={false}
          enterkeyhint="go"
          placeholder={words.serial_placeholder}
          onInput={(event) => {
            serial.value = event.currentTarget.value;
          }}
          onKeyDown={(event) => {
            if (event.key === "Enter") begin();
          }}
        />
      </div>
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

/** Moves the focus to the serial number when a character is typed, so that a barcode scanner always works. */
function focusOnTyping(field: HTMLInputElement | null): () => void {
  field?.focus({ preventScroll: true });
  const onKey = (event: KeyboardEvent) => {
    const printable =
      event.key.length === 1 && event.key !== " " && !event.ctrlKey && !event.metaKey && !event.altKey;
    const elsewhere = event.target instanceof Element && event.target.closest("input, select, textarea, dialog");
    if (printable && !elsewhere && !document.querySelector("dialog[open]")) field?.focus();
  };
  addEventListener("keydown", onKey);
  return () => removeEventListener("keydown", onKey);
}

function Remedy({ obstacle }: { obstacle: Obstacle }) {
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
function Ended({ failed }: { failed: ReadonlySignal<Job | undefined> }) {
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
