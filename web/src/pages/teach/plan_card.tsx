/** The characteristics of the plan with their limits, and what an inspection with it would say about this scan. */

import type { Form } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { ProblemCard } from "../../components/problem";
import { VerdictWord } from "../../components/verdict";
import { language, text } from "../../text";
import { decimal } from "../../units";
import { Remarks } from "../inspections/remarks";
import { measureName, uncertaintyOf } from "../inspections/values";
import { type Characteristic, isDeviation, type Limits, limitsIn, unitOf, withLimits } from "./draft";
import type { TeachState } from "./teach_state";

export function PlanCard({ state, form }: { state: TeachState; form: Form }) {
  const words = text.value.teach;
  const { characteristics, alignment } = state.plan.value;
  return (
    <section class="card stack" aria-label={words.plan}>
      <h2>{words.plan}</h2>
      {alignment && <p class="muted">{words.aligned}</p>}
      <OnThisScan state={state} />
      {characteristics.length === 0 ? (
        <p class="muted">{words.plan_empty}</p>
      ) : (
        <table class="wide">
          <thead>
            <tr>
              <th>{text.value.inspections.characteristic}</th>
              <th class="number">{words.actual}</th>
              <th class="number">U</th>
              <th>{text.value.inspections.verdict}</th>
              <th>{words.limits}</th>
              <th>
                <span class="visually-hidden">{words.remove}</span>
              </th>
            </tr>
          </thead>
          <tbody>
            {characteristics.map((one) => (
              <Row key={one.id} state={state} one={one} form={form} />
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}

/** The verdict of the plan on this scan, and why there is none. */
function OnThisScan({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const { answered, running, problem } = state.trial;
  const candidate = state.candidate.value !== undefined;
  const { verdict, alignment_failure } = answered.value?.said ?? {};
  // A problem of the candidate is shown beside it.
  if (problem.value && !candidate) return <ProblemCard problem={problem.value} />;
  if (running.value) return <p class="muted">{words.evaluating}</p>;
  return (
    <>
      {alignment_failure && (
        <p class="note">
          {text.value.inspections.no_datum}: <span lang="en">{alignment_failure}</span>
        </p>
      )}
      {state.is_current.value && !candidate && state.has_limits.value && verdict && (
        <p data-plan-verdict={verdict}>
          {words.this_scan}: <VerdictWord verdict={verdict} />
        </p>
      )}
    </>
  );
}

function Row({ state, one, form }: { state: TeachState; one: Characteristic; form: Form }) {
  const words = text.value.teach;
  const common = text.value.inspections;
  const result = state.results.value.get(one.id);
  const current = state.is_current.value;
  const unit = unitOf(one);
  const limits = limitsIn(one);
  const change = (part: Limits) => {
    state.plan.value = withLimits(state.plan.peek(), one.id, part);
  };
  const fields = [
    ["nominal", words.nominal],
    ["lower", words.lower],
    ["upper", words.upper],
  ] as const;
  const shown = isDeviation(one) ? fields.slice(2) : fields;
  const has_place = state.on_cloud.value?.places.has(one.id) || state.surface.comparison(one.id) !== undefined;
  const is_shown = state.current.value === one.id;
  return (
    <tr data-taught={one.id} data-current={current} aria-current={is_shown ? "true" : undefined}>
      <td>
        <strong>{one.id}</strong> <span class="muted">{measureName({ measure: one.measure.type })}</span>{" "}
        {has_place && (
          <button type="button" aria-pressed={is_shown} onClick={() => state.show(one.id)}>
            {common.show_on_cloud}
            <span class="visually-hidden">: {one.id}</span>
          </button>
        )}
        {result && current && <Remarks result={result} />}
      </td>
      <td class={current ? "number nowrap" : "number nowrap muted"} data-label={words.actual}>
        {result?.value == null ? "–" : `${decimal(result.value, 4, language.value)} ${unit}`}
      </td>
      <td class={current ? "number nowrap" : "number nowrap muted"} data-label="U">
        {result ? uncertaintyOf(result) : "–"}
      </td>
      <td data-label={common.verdict}>
        <VerdictWord verdict={current ? (result?.verdict ?? undefined) : undefined} />
      </td>
      <td data-label={words.limits}>
        <span class="row end limits">
          {shown.map(([name, label]) => (
            <NumberField
              key={name}
              form={form}
              label={label}
              unit={unit}
              optional
              value={limits[name]}
              onChange={(value) => change({ [name]: value })}
            />
          ))}
        </span>
      </td>
      <td>
        <button type="button" aria-label={words.remove_named(one.id)} onClick={() => state.remove(one.id)}>
          {words.remove}
        </button>
      </td>
    </tr>
  );
}
