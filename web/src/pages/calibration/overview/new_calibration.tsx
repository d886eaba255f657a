/** The three ways to a new calibration, and the progress of running ones. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, idempotencyKey, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { problemOfJob, succeeded } from "../../../components/job/job_problem";
import { JobProgress } from "../../../components/job/job_progress";
import { ProblemCard } from "../../../components/problem";
import { useHalted } from "../../../components/station/halted";
import { href } from "../../../state/browser/route";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { UploadButton } from "./upload_button";

/** Starts a calibration and waits for its result. */
function useCalibrating(reload: () => Promise<void>) {
  const { api, jobs } = useApp();
  const new_id = useSignal<string | undefined>(undefined);
  const calibrate = async (body: Schemas["StartCalibrationDto"], accepted: () => void) => {
    new_id.value = undefined;
    const headers = { "Idempotency-Key": idempotencyKey() };
    const job = await data(api.POST("/api/v1/calibrations", { body, headers }));
    jobs.update(job);
    accepted();
    new_id.value = succeeded(await jobs.ended(job.id));
    await reload();
  };
  return { new_id, calibrate };
}

interface Properties {
  /** The active calibration: the note about a new draft disappears when the draft is activated. */
  active_id: string | undefined;
  reload: () => Promise<void>;
}

export function NewCalibration({ active_id, reload }: Properties) {
  const { station, jobs } = useApp();
  const words = text.value.calibration;
  const { new_id, calibrate } = useCalibrating(reload);
  const now = useMemo(
    () => new Command((steps) => calibrate({ source: { kind: "station" } }, () => steps.accepted())),
    [],
  );
  const open = jobs.open.value.filter((job) => job.kind === "calibration");
  const failed = jobs.list.value.find((job) => job.kind === "calibration" && job.state === "failed");
  const simulated = station.simulated.value === "twin";
  const halted = useHalted();
  const blocked = !simulated
    ? words.now_blocked
    : halted
      ? halted
      : station.busy.value && !now.running
        ? words.busy
        : undefined;
  return (
    <section class="card stack begin">
      <h2>{words.new_calibration}</h2>
      <ul class="ways">
        <li>
          <CommandButton command={now} kind="primary" blocked={blocked}>
            {words.now}
          </CommandButton>
          {simulated && <span class="muted">{words.now_hint}</span>}
        </li>
        <li>
          <a class="button" href={href("calibration", undefined, { begin: "session" })}>
            {words.step_by_step}
          </a>
          <span class="muted">{words.step_by_step_hint}</span>
        </li>
        <li>
          <UploadButton
            onUploaded={(capture_id, accepted) => calibrate({ source: { kind: "capture", capture_id } }, accepted)}
          />
          <span class="muted">{words.upload_hint}</span>
        </li>
      </ul>
      {open.map((job) => (
        <div key={job.id} class="stack">
          <h3>{words.running}</h3>
          <JobProgress job={job} />
        </div>
      ))}
      {new_id.value && new_id.value !== active_id && (
        <div class="note fresh" data-fresh={new_id.value}>
          <strong>{words.new_draft}</strong> <span class="mono">{new_id.value}</span>
          <div>{words.new_draft_hint}</div>
          <a href={href("calibration", undefined, { show: new_id.value })}>{words.view_new_draft}</a>
        </div>
      )}
      {failed && failed === jobs.list.value.find((job) => job.kind === "calibration") && !now.problem.value && (
        <ProblemCard problem={problemOfJob(failed)} />
      )}
    </section>
  );
}
