/** For gloves and distance: serial number, Start, the last result, the last parts. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { DamagedRecords } from "../../parts/damaged";
import { useFollowed } from "../../parts/followed";
import { useForm } from "../../parts/form";
import { ProblemCard } from "../../parts/problem";
import { ScannedParts } from "../../state/scanned";
import { text } from "../../text";
import { LastResult } from "./last_result";
import { Operation } from "./operation";
import { obstacleOf } from "./readiness";
import { firstRecipe, kept_recipe, parseRecipe } from "./recipe";
import { SetUp } from "./set_up";
import { Start } from "./start";
import { TICKS, Ticks } from "./ticks";
import "./operate.css";

export default function Operate() {
  const app = useApp();
  const { api, station, jobs } = app;
  const serial = useSignal("");
  const form = useForm();
  const simulated = station.simulated.value === "twin";
  const recipe = useMemo(
    () => parseRecipe(kept_recipe.value, firstRecipe(simulated)),
    [kept_recipe.value, simulated],
  );
  const present = useRef(recipe);
  present.current = recipe;
  const operation = useMemo(() => new Operation(app, serial, () => present.current), [app, serial]);

  const active = useFollowed(
    () => data(api.GET("/api/v1/calibrations/active")),
    (event) => event.kind.startsWith("calibration."),
  );
  const parts = useLastParts();
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
      <LastResult part={shown?.parts[0]} recipe={recipe} measuring={operation.measuring.value} />
      {problem && <ProblemCard problem={problem} />}
      <DamagedRecords rows={shown?.damaged ?? []} />
      <Ticks parts={shown?.parts ?? []} />
      <SetUp
        recipe={recipe}
        form={form}
        travel_mm={station.status.value?.stage.travel_mm ?? []}
        onChange={(changed) => {
          kept_recipe.value = JSON.stringify(changed);
        }}
      />
    </div>
  );
}

/** A job that waits for the station, or works on it before the status says so. */
function waiting<J extends { kind: string }>(open: readonly J[]): J | undefined {
  return open.find((job) => job.kind === "scan");
}

/** The newest parts with their measurements, followed by events. */
function useLastParts() {
  const { api, events } = useApp();
  const reader = useMemo(() => new ScannedParts(api), [api]);
  useEffect(
    () =>
      events.follow((news) => {
        if (news.length === 0) reader.forgetAll();
        for (const { kind, body } of news) {
          const scan_id = (body as { scan_id?: string } | null)?.scan_id;
          if (kind === "measurement.made" && scan_id) reader.forget(scan_id);
        }
      }),
    [events, reader],
  );
  return useFollowed(
    () => reader.page(TICKS),
    ({ kind }) => kind.startsWith("scan.") || kind === "measurement.made",
  );
}
