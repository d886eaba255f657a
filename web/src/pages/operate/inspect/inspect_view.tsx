/** Operate with a recipe: serial number, Start, progress, verdict, and the last parts. */

import { useSignal } from "@preact/signals";
import { useMemo, useRef } from "preact/hooks";
import type { Job } from "../../../api/client";
import { useApp } from "../../../app";
import { DamagedRecords } from "../../../components/dialogs/damaged";
import { useAutoReloaded } from "../../../components/loading/auto_reloaded";
import { ProblemCard } from "../../../components/problem";
import { readNewestParts } from "../../../state/records/inspections";
import type { Obstacle } from "../readiness";
import { type Choice, storedChoice } from "./choice";
import { InspectionRun } from "./inspection_run";
import { lastOf } from "./last";
import { LastInspection } from "./last_inspection";
import { LastInspections, N_LAST_INSPECTIONS } from "./last_inspections";
import { StartInspection } from "./start_inspection";
import "./inspect.css";

interface Properties {
  choice: Choice;
  obstacle: Obstacle | undefined;
  job: Job | undefined;
  /** Whether the queue is on hold. */
  held: boolean;
}

export function InspectView({ choice, obstacle, job, held }: Properties) {
  const app = useApp();
  const { api } = app;
  const part = { serial: useSignal(""), order: useSignal("") };
  const current = useRef(choice);
  current.current = choice;
  const run = useMemo(
    () =>
      new InspectionRun(
        app,
        part,
        () => (current.current.kind === "recipe" ? storedChoice(current.current) : undefined),
        () => app.control.entered_name,
      ),
    [app],
  );
  const parts = useAutoReloaded(
    () => readNewestParts(api, N_LAST_INSPECTIONS),
    ({ kind }) => kind === "inspection.finished",
  );
  const { value: shown, problem } = parts.state.value;
  return (
    <>
      <StartInspection run={run} part={part} choice={choice} obstacle={obstacle} job={job} held={held} />
      <LastInspection last={shown && lastOf(shown.items, run.newest.value)} />
      {problem && <ProblemCard problem={problem} />}
      <DamagedRecords rows={shown?.damaged ?? []} />
      {shown && <LastInspections items={shown.items} />}
    </>
  );
}
