/** One characteristic: region, tool, its value on this scan, and limits. */

import { CommandButton } from "../../components/command_button";
import { Choice } from "../../components/fields/choice";
import { useForm } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { ProblemCard } from "../../components/problem";
import { ReasonedButton } from "../../components/reasoned_button";
import { VerdictWord } from "../../components/verdict";
import { language, text } from "../../text";
import { count, decimal } from "../../units";
import { Remarks } from "../inspections/remarks";
import { uncertaintyOf } from "../inspections/values";
import { TAUGHT } from "./draft";
import { IdField } from "./id_field";
import type { TeachState } from "./teach_state";

/** Decimals of a proposed nominal value: drawings rarely state more. */
const NOMINAL_DIGITS = 2;

/** Found above the largest plane of the region. */
const ON_TABLE = /^(sphere|cylinder)_/;

export function ToolCard({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const form = useForm();
  const taught = state.taught.value;
  const only_upper = taught === "flatness";
  const unit = taught === "angle" ? "°" : "mm";
  const { nominal, lower, upper } = state.limits.value;
  const value = state.candidate_result.value?.value;
  const change = (part: Partial<typeof state.limits.value>) => {
    state.limits.value = { ...state.limits.peek(), ...part };
  };
  return (
    <section class="card stack" aria-label={words.characteristic}>
      <h2>{words.characteristic}</h2>
      <p class="muted">{state.result.view.region.value ? words.region_set : words.region_none}</p>
      <div class="row end">
        <Choice
          label={words.tool}
          value={taught}
          options={TAUGHT.map((one) => [one, words.tools[one]])}
          onChange={(one) => state.choose(one)}
        />
        <CommandButton command={state.measure} kind="primary" blocked={blockedMeasure(state)}>
          {words.measure}
        </CommandButton>
      </div>
      {state.result.view.region.value && ON_TABLE.test(taught) && <p class="muted">{words.with_table}</p>}
      {state.candidate.value && <TrialFacts state={state} />}
      <div class="row end">
        <IdField id={state.id} />
        {!only_upper && (
          <>
            <NumberField
              key={`nominal-${taught}`}
              form={form}
              label={words.nominal}
              unit={unit}
              optional
              value={nominal}
              onChange={(value) => change({ nominal: value })}
            />
            <NumberField
              key={`lower-${taught}`}
              form={form}
              label={words.lower}
              unit={unit}
              optional
              max={upper}
              value={lower}
              onChange={(value) => change({ lower: value })}
            />
          </>
        )}
        <NumberField
          key={`upper-${taught}`}
          form={form}
          label={words.upper}
          unit={unit}
          optional
          min={lower}
          value={upper}
          onChange={(value) => change({ upper: value })}
        />
        {!only_upper && value != null && (
          <button type="button" onClick={() => change({ nominal: Number(value.toFixed(NOMINAL_DIGITS)) })}>
            {words.take_nominal}
          </button>
        )}
      </div>
      <Add state={state} fault={form.blocked.value} />
    </section>
  );
}

function blockedMeasure(state: TeachState): string | undefined {
  return state.scan.cloud ? state.pose_blocked.value : text.value.teach.no_cloud;
}

function Add({ state, fault }: { state: TeachState; fault: string | undefined }) {
  const words = text.value.teach;
  const id_fault = state.id_fault.value;
  const measured = state.candidate_result.value?.value != null;
  const blocked = measured ? ((id_fault && words.id_faults[id_fault]) ?? fault) : words.blocked_measure;
  return <ReasonedButton label={words.add} blocked={blocked} onClick={() => state.add()} />;
}

/** The result of what was measured, as an inspection would give it. */
function TrialFacts({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const result = state.candidate_result.value;
  const problem = state.trial.problem.value;
  if (problem) return <ProblemCard problem={problem} />;
  if (!result) return <p class="muted">{words.evaluating}</p>;
  const current = state.is_current.value;
  const { value, unit, verdict } = result;
  return (
    <div class="stack trial" data-trial={result.measure} data-current={current} role="status">
      <dl class="facts">
        <dt>{words.actual}</dt>
        <dd>
          <strong class="big-value">
            {value == null ? words.not_found : `${decimal(value, 4, language.value)} ${unit}`}
          </strong>
        </dd>
        <dt>U (k = 2)</dt>
        <dd>{uncertaintyOf(result)}</dd>
        <dt>{text.value.inspections.verdict}</dt>
        <dd>{!current ? words.evaluating : verdict ? <VerdictWord verdict={verdict} /> : words.without_limits}</dd>
        <dt>{words.points}</dt>
        <dd>{count(nPoints(state), language.value)}</dd>
      </dl>
      <Remarks result={result} />
    </div>
  );
}

/** Number of points of the features that the candidate has of its own. */
function nPoints(state: TeachState): number {
  const known = new Set(state.plan.value.features.map(({ id }) => id));
  const features = state.trial.answered.value?.said.features ?? [];
  return features.filter(({ id }) => !known.has(id)).reduce((sum, { n_points }) => sum + n_points, 0);
}
