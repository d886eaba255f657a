/** The calibration wizard. All progress is stored in the session on the server. */

import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { data, type Job } from "../../../api/client";
import { useApp } from "../../../app";
import { EVERY_EVENT, useAutoReloaded } from "../../../components/loading/auto_reloaded";
import { ProblemCard } from "../../../components/problem";
import { goTo, href, route } from "../../../state/browser/route";
import { text } from "../../../text";
import { Discard } from "../session/open_sessions";
import { type Change, useSessionChange } from "../session/session_change";
import { calibrationOf, isDone, type Session, STEPS, type Step, stepOf } from "../session/session_state";
import { CameraStep } from "./camera_step";
import { StationCheck } from "./check_step";
import { FinishStep } from "./finish_step";
import { LightStep } from "./light_step";
import { StageStep } from "./stage_step";
import { isVerified, type Verification, verificationsOf } from "./verifications";
import { VerifyStep } from "./verify_step";

/** Properties of every step. */
export interface StepProperties {
  session: Session;
  /** The job that computes the calibration. */
  job: Job | undefined;
  /** The calibration created by the job. */
  calibration_id: string | undefined;
  verifications: readonly Verification[];
  /** Changes the session unless someone else has changed it in the meantime; always the same function. */
  change: Change;
  reload: () => Promise<void>;
}

/** Number of newest jobs searched for verifications. */
const N_JOBS_SEARCHED = 200;

export function Wizard({ id }: { id: string }) {
  const { api, jobs } = useApp();
  const words = text.value.calibration;
  const loaded = useAutoReloaded(
    async () => {
      const session = await data(api.GET("/api/v1/calibration-sessions/{id}", { params: { path: { id } } }));
      const { job_id } = session.body;
      const job = job_id
        ? await data(api.GET("/api/v1/jobs/{id}", { params: { path: { id: job_id } } })).catch(() => undefined)
        : undefined;
      const calibration_id = calibrationOf(job);
      const all = calibration_id
        ? (await data(api.GET("/api/v1/jobs", { params: { query: { limit: N_JOBS_SEARCHED } } }))).items
        : [];
      const verifications = calibration_id ? verificationsOf(all, calibration_id) : [];
      const query = { purpose: "verification" as const, ...(calibration_id !== undefined && { calibration_id }) };
      const scans = calibration_id ? (await data(api.GET("/api/v1/scans", { params: { query } }))).items : [];
      return { session, job, verifications, verified: isVerified(verifications, scans) };
    },
    EVERY_EVENT,
    [id],
  );
  const { value, problem } = loaded.state.value;
  const { session, change, conflict } = useSessionChange(value?.session, loaded.reload);
  if (!value || !session) {
    return problem ? (
      <Missing>
        <ProblemCard problem={problem} />
      </Missing>
    ) : (
      <p class="muted">{text.value.frame.loading}</p>
    );
  }
  // The job stream is more recent than the loaded job.
  const job = value.job && (jobs.get(value.job.id) ?? value.job);
  const { verified } = value;
  const step = chosenStep() ?? stepOf(session, job, verified);
  const Step = STEP_VIEWS[step];
  return (
    <div class="calibration wizard" data-step={step} data-session-version={session.version}>
      <WizardHeader session={session} />
      <StepList current={step} id={id} isDone={(step) => isDone(step, session, job, verified)} />
      <p class="muted untouched">{words.active_untouched}</p>
      {problem && <ProblemCard problem={problem} />}
      {conflict.value && (
        <ProblemCard
          problem={conflict.value}
          onDismiss={() => {
            conflict.value = undefined;
          }}
        />
      )}
      <Step
        key={step}
        session={session}
        job={job}
        calibration_id={calibrationOf(job)}
        verifications={value.verifications}
        change={change}
        reload={loaded.reload}
      />
    </div>
  );
}

const STEP_VIEWS: Record<Step, (properties: StepProperties) => ComponentChildren> = {
  check: StationCheck,
  camera: CameraStep,
  light: LightStep,
  stage: StageStep,
  verify: VerifyStep,
  finish: FinishStep,
};

/** The step given in the URL, if any; otherwise the step follows from the session. */
function chosenStep(): Step | undefined {
  const named = route.value.query.get("step");
  return STEPS.find((step) => step === named);
}

export function goToStep(session_id: string, step: Step): void {
  goTo("calibration", session_id, { step });
}

function Missing({ children }: { children: ComponentChildren }) {
  const words = text.value.calibration;
  return (
    <div class="stack">
      {children}
      <p>{words.not_found_hint}</p>
      <p>
        <a class="button" href={href("calibration")}>
          {words.to_overview}
        </a>
      </p>
    </div>
  );
}

function WizardHeader({ session }: { session: Session }) {
  const words = text.value.calibration;
  const asking = useSignal(false);
  return (
    <header class="row wizard-header">
      <h1 class="grow">{session.body.name}</h1>
      <a class="button" href={href("calibration")} title={words.to_overview_hint}>
        {words.to_overview}
      </a>
      <button
        type="button"
        onClick={() => {
          asking.value = true;
        }}
      >
        {words.discard}
      </button>
      {asking.value && (
        <Discard
          session={session}
          onDone={async () => goTo("calibration")}
          onClose={() => {
            asking.value = false;
          }}
        />
      )}
    </header>
  );
}

function StepList({ current, id, isDone }: { current: Step; id: string; isDone: (step: Step) => boolean }) {
  const words = text.value.calibration;
  return (
    <nav aria-label={words.steps}>
      <ol class="steps">
        {STEPS.map((step, idx) => (
          <li key={step}>
            <a href={href("calibration", id, { step })} aria-current={step === current ? "step" : undefined}>
              <span class="step-mark" aria-hidden="true">
                {isDone(step) ? "✓" : idx + 1}
              </span>
              <span>{words.step_names[step]}</span>
              <span class="visually-hidden">{isDone(step) ? words.step_done : words.step_open}</span>
            </a>
          </li>
        ))}
      </ol>
    </nav>
  );
}
