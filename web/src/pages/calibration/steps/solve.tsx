/** Computes the calibration from the session's images. */

import { useMemo } from "preact/hooks";
import { data, idempotencyKey } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { problemOfJob, succeeded } from "../../../components/job/job_problem";
import { JobProgress } from "../../../components/job/job_progress";
import { Show } from "../../../components/loading/loading";
import { ProblemCard } from "../../../components/problem";
import { hasEnded } from "../../../state/records/jobs";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { useCalibration } from "../details/details";
import { FEWEST_BOARDS, readableBoards, type Session } from "../session/session_state";
import { goToStep, type StepProperties } from "./wizard";

export function Solve({ session, job, calibration_id, reload }: StepProperties) {
  const { api, jobs } = useApp();
  const words = text.value.calibration;
  const solve = useMemo(
    () =>
      new Command(async (steps) => {
        const params = { path: { id: session.id } };
        const headers = { "Idempotency-Key": idempotencyKey() };
        const job = await data(
          api.POST("/api/v1/calibration-sessions/{id}/solve", {
            params,
            body: { k3: null, light_model: null },
            headers,
          }),
        );
        jobs.update(job);
        steps.accepted();
        await reload();
        succeeded(await jobs.ended(job.id));
        await reload();
      }),
    [api, session.id],
  );
  const n = readableBoards(session);
  const open = job && !hasEnded(job);
  const blocked = n < FEWEST_BOARDS && words.solve_blocked(String(n), String(FEWEST_BOARDS));
  const failed = job && hasEnded(job) && job.state !== "succeeded" && !solve.problem.value && !solve.running;
  return (
    <section class="card stack solve">
      <h2>{words.solve_title}</h2>
      <p>{words.solve_hint}</p>
      {session.body.stage_views.length === 0 && <p class="note">{words.solve_no_stage}</p>}
      {open && <JobProgress job={job} />}
      {failed && <ProblemCard problem={problemOfJob(job)} />}
      {calibration_id && <SolvedCalibration id={calibration_id} session={session} />}
      <div class="row">
        <CommandButton
          command={solve}
          kind={calibration_id ? undefined : "primary"}
          blocked={blocked || (open && !solve.running && words.busy)}
        >
          {calibration_id ? words.solve_again : words.solve}
        </CommandButton>
        {calibration_id && (
          <button type="button" class="primary" onClick={() => goToStep(session.id, "verify")}>
            {words.next(words.step_names.verify ?? "")}
          </button>
        )}
      </div>
    </section>
  );
}

function SolvedCalibration({ id, session }: { id: string; session: Session }) {
  const words = text.value.calibration;
  const { state } = useCalibration(id);
  return (
    <div data-made={id}>
      <strong>{words.solved(id)}</strong> <span class="muted">{words.solved_hint}</span>
      <Show of={state}>
        {(calibration) => {
          const { n_poses, n_stage_views, warnings } = calibration.summary;
          const views = session.body.stage_views.filter((view) => view.board.corners.length > 0).length;
          const old = n_poses !== readableBoards(session) || n_stage_views !== views;
          return (
            <>
              {old && <p class="note">{words.solved_old}</p>}
              {warnings.map((warning) => (
                <p class="note" key={warning} lang="en">
                  {warning}
                </p>
              ))}
            </>
          );
        }}
      </Show>
    </div>
  );
}
