/** Operate without a recipe: a scan with the measurements of the plan, and their verdict. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import type { Job } from "../../api/client";
import { useApp } from "../../app";
import { DamagedRecords } from "../../components/dialogs/damaged";
import { useForm } from "../../components/fields/form";
import { useAutoReloaded } from "../../components/loading/auto_reloaded";
import { ProblemCard } from "../../components/problem";
import { MeasurementPlan } from "../../state/records/measurement_plan";
import { readParts } from "../../state/records/scanned";
import { lastOf } from "./last_part";
import { LastParts, N_LAST_PARTS } from "./last_parts";
import { LastResult } from "./last_result";
import { Operation } from "./operation";
import type { Obstacle } from "./readiness";
import { SetUp } from "./set_up";
import { Start } from "./start";

interface Properties {
  /** Why nothing can start; `busy` is about `job`. */
  obstacle: Obstacle | undefined;
  /** The job that waits for the station or uses it. */
  job: Job | undefined;
}

export function ScanView({ obstacle, job }: Properties) {
  const app = useApp();
  const { api, events, station } = app;
  const serial = useSignal("");
  const plan = useMemo(() => new MeasurementPlan(api), [api]);
  useEffect(() => {
    void plan.load();
    const end = events.follow((new_events) => {
      const changed = ({ kind }: { kind: string }) => kind === "measurement_plan.changed";
      if (new_events.length === 0 || new_events.some(changed)) void plan.load();
    });
    return () => {
      end();
      // Save pending input when the page is left.
      void plan.saved();
    };
  }, [plan, events]);
  const operation = useMemo(() => new Operation(app, serial, plan), [app, serial, plan]);
  const form = useForm();
  const parts = useAutoReloaded(
    () => readParts(api, N_LAST_PARTS, { purpose: "production" }),
    ({ kind }) => kind.startsWith("scan.") || kind.startsWith("measurement."),
  );
  const { value: shown, problem } = parts.state.value;
  return (
    <>
      <Start operation={operation} serial={serial} obstacle={obstacle} wrong={form.blocked.value} job={job} />
      <LastResult last={lastOf(shown?.parts, operation.newest.value)} />
      {problem && <ProblemCard problem={problem} />}
      <DamagedRecords rows={shown?.damaged ?? []} />
      <LastParts parts={shown?.parts ?? []} />
      <SetUp plan={plan} form={form} travel={station.travel.value} />
    </>
  );
}
