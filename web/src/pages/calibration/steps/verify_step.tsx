/** Scans a reference part with the new calibration and compares the measured with the reference value. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, idempotencyKey, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Choice } from "../../../components/fields/choice";
import { useForm } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { problemOfJob, succeeded } from "../../../components/job/job_problem";
import { JobProgress } from "../../../components/job/job_progress";
import { Show, useLoaded } from "../../../components/loading/loading";
import { ProblemCard } from "../../../components/problem";
import { useHalted } from "../../../components/station/halted";
import { hasEnded } from "../../../state/records/jobs";
import { OUTCOME_SYMBOL, VERDICTS } from "../../../state/records/outcome";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { dateTime, decimal } from "../../../units";
import { measurementOf, type Verification } from "./verifications";
import { goToStep, type StepProperties } from "./wizard";

type ReferencePart = Schemas["ReferencePartDto"];

const REFERENCE_PARTS: readonly ReferencePart[] = ["sphere", "gauge"];

/** Default reference values: sizes of the parts of the simulated station. */
const NOMINAL_MM: Record<ReferencePart, number> = { gauge: 8.9, sphere: 18.9 };

const FIRST_TOLERANCE_MM = 0.1;

export function VerifyStep({ session, calibration_id, verifications, reload }: StepProperties) {
  const words = text.value.calibration;
  return (
    <div class="stack">
      <p>{words.verify_lead}</p>
      {calibration_id ? (
        <VerifyForm session_id={session.id} calibration_id={calibration_id} reload={reload} />
      ) : (
        <p class="note">{words.verify_blocked}</p>
      )}
      <section class="card stack">
        <h2>{words.step_names.verify}</h2>
        {verifications.length === 0 && <p class="muted">{words.verified_none}</p>}
        {verifications.map((verification) => (
          <Outcome key={verification.job.id} verification={verification} />
        ))}
      </section>
      <div>
        <button type="button" class="primary" onClick={() => goToStep(session.id, "finish")}>
          {words.next(words.step_names.finish ?? "")}
        </button>
      </div>
    </div>
  );
}

interface FormProperties {
  session_id: string;
  calibration_id: string;
  reload: () => Promise<void>;
}

function VerifyForm({ session_id, calibration_id, reload }: FormProperties) {
  const { api, jobs, station } = useApp();
  const words = text.value.calibration;
  const reference_part = useSignal<ReferencePart>("sphere");
  const nominal_mm = useSignal<number | undefined>(NOMINAL_MM.sphere);
  const tolerance_mm = useSignal<number | undefined>(FIRST_TOLERANCE_MM);
  const form = useForm();
  const halted = useHalted();
  const verify = useMemo(
    () =>
      new Command(async (steps) => {
        // A successful verification moves the session to its last step; stay on this one to show the result.
        goToStep(session_id, "verify");
        const job = await data(
          api.POST("/api/v1/verifications", {
            headers: { "Idempotency-Key": idempotencyKey() },
            body: {
              reference_part: reference_part.value,
              nominal_mm: nominal_mm.value ?? NOMINAL_MM[reference_part.value],
              tolerance_mm: tolerance_mm.value ?? null,
              scan: { source: { kind: "station" }, calibration_id },
            },
          }),
        );
        jobs.update(job);
        steps.accepted();
        await reload();
        succeeded(await jobs.ended(job.id));
        await reload();
      }),
    [api, session_id, calibration_id],
  );
  return (
    <section class="card stack">
      <div class="row end">
        <Choice
          label={words.reference_part}
          value={reference_part.value}
          options={REFERENCE_PARTS.map((name) => [name, words.reference_parts[name] ?? name])}
          onChange={(name) => {
            reference_part.value = name;
            nominal_mm.value = NOMINAL_MM[name];
          }}
        />
        <NumberField
          form={form}
          label={words.nominal}
          unit="mm"
          value={nominal_mm.value}
          min={0.1}
          max={200}
          onChange={(value) => {
            nominal_mm.value = value;
          }}
        />
        <NumberField
          form={form}
          label={words.tolerance}
          unit="mm"
          optional
          value={tolerance_mm.value}
          min={0.0001}
          max={100}
          onChange={(value) => {
            tolerance_mm.value = value;
          }}
        />
      </div>
      <p class="muted">{station.simulated.value === "twin" ? words.verify_hint_simulated : words.verify_hint}</p>
      <div>
        <CommandButton
          command={verify}
          kind="primary"
          blocked={halted ?? form.blocked.value ?? (station.busy.value && !verify.running && words.busy)}
        >
          {words.verify_now}
        </CommandButton>
      </div>
    </section>
  );
}

function Outcome({ verification }: { verification: Verification }) {
  const { jobs } = useApp();
  const job = jobs.get(verification.job.id) ?? verification.job;
  if (!hasEnded(job)) return <JobProgress job={job} />;
  if (job.state !== "succeeded") return <ProblemCard problem={problemOfJob(job)} />;
  return <MeasuredCard verification={{ ...verification, job }} />;
}

function MeasuredCard({ verification }: { verification: Verification }) {
  const { api } = useApp();
  const words = text.value.calibration;
  const { job, reference_part, nominal_mm, tolerance_mm } = verification;
  const { state } = useLoaded(async () => {
    const ids = measurementOf(job);
    if (!ids) return undefined;
    const params = { path: { id: ids.scan_id, measurement_id: ids.measurement_id } };
    return (await data(api.GET("/api/v1/scans/{id}/measurements/{measurement_id}", { params }))).result;
  }, [job.id]);
  const length = (value: number | null | undefined) =>
    value == null ? "–" : `${decimal(value, 4, language.value)} mm`;
  const verdict = VERDICTS.find((known) => known === state.value.value?.verdict);
  return (
    <Show of={state}>
      {(measured) =>
        measured && (
          <div class="outcome" data-verdict={measured.verdict ?? "none"}>
            <div class={verdict && verdict !== "ok" ? "big verdict bad" : "big verdict"}>
              {verdict ? `${OUTCOME_SYMBOL[verdict]} ${text.value.outcomes[verdict]}` : words.no_verdict}
            </div>
            <dl class="facts">
              <dt>{words.reference_part}</dt>
              <dd>{words.reference_parts[reference_part] ?? reference_part}</dd>
              <dt>{words.reference_size}</dt>
              <dd>
                {length(nominal_mm)} {tolerance_mm !== undefined && `± ${length(tolerance_mm)}`}
              </dd>
              <dt>{words.measured}</dt>
              <dd>{length(measured.value)}</dd>
              <dt>{words.deviation}</dt>
              <dd>{length(measured.error)}</dd>
              <dt>{words.uncertainty}</dt>
              <dd>{length(measured.expanded_uncertainty)}</dd>
            </dl>
            <small class="muted">{dateTime(job.ended_at_ms, language.value)}</small>
          </div>
        )
      }
    </Show>
  );
}
