/** The operator page, for use with gloves and from a distance: serial number, Start, last result, last parts. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { DamagedRecords } from "../../components/dialogs/damaged";
import { useForm } from "../../components/fields/form";
import { useAutoReloaded } from "../../components/loading/auto_reloaded";
import { ProblemCard } from "../../components/problem";
import { MeasurementPlan } from "../../state/records/measurement_plan";
import { readParts } from "../../state/records/scanned";
import { text } from "../../text";
import { lastOf } from "./last_part";
import { LastParts, N_LAST_PARTS } from "./last_parts";
import { LastResult } from "./last_result";
import { Operation } from "./operation";
import { obstacleOf } from "./readiness";
import { SetUp } from "./set_up";
import { Start } from "./start";
import "./operate.css";

export default function Operate() {
  const app = useApp();
  const { api, events, station, jobs } = app;
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

  const active = useAutoReloaded(
    () => data(api.GET("/api/v1/calibrations/active")),
    (event) => event.kind.startsWith("calibration."),
  );
  const parts = useAutoReloaded(
    () => readParts(api, N_LAST_PARTS, { purpose: "production" }),
    ({ kind }) => kind.startsWith("scan.") || kind.startsWith("measurement."),
  );
  const calibration = active.state.value.value;
  const job = jobs.open.value.find((job) => job.id === station.status.value?.job_id) ?? waiting(jobs.open.value);
  const obstacle = obstacleOf({
    stale: station.stale.value,
    status: station.status.value,
    calibrated: calibration === undefined ? undefined : calibration.calibration_id != null,
    busy: job !== undefined,
  });
  const { value: shown, problem } = parts.state.value;
  return (
    <div class="operate">
      <h1 class="visually-hidden">{text.value.operate.title}</h1>
      <Start operation={operation} serial={serial} obstacle={obstacle} wrong={form.blocked.value} job={job} />
      <LastResult last={lastOf(shown?.parts, operation.newest.value)} />
      {problem && <ProblemCard problem={problem} />}
      <DamagedRecords rows={shown?.damaged ?? []} />
      <LastParts parts={shown?.parts ?? []} />
      <SetUp plan={plan} form={form} travel={station.travel.value} />
    </div>
  );
}

/** A scan that is waiting, or has just started. */
function waiting<J extends { kind: string }>(open: readonly J[]): J | undefined {
  return open.find((job) => job.kind === "scan");
}
