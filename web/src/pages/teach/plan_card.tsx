/** The characteristics of the plan with their limits. */

import type { Form } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { language, text } from "../../text";
import { decimal, length } from "../../units";
import { measureName } from "../inspections/values";
import { type Characteristic, type Limits, limitsIn, unitOf, withLimits } from "./draft";
import type { TeachState } from "./teach_state";

export function PlanCard({ state, form }: { state: TeachState; form: Form }) {
  const words = text.value.teach;
  const { characteristics, alignment } = state.plan.value;
  return (
    <section class="card stack" aria-label={words.plan}>
      <h2>{words.plan}</h2>
      {alignment && <p class="muted">{words.aligned}</p>}
      {characteristics.length === 0 ? (
        <p class="muted">{words.plan_empty}</p>
      ) : (
        <table class="wide">
          <thead>
            <tr>
              <th>{text.value.inspections.characteristic}</th>
              <th class="number">{words.actual}</th>
              <th class="number">U</th>
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

function Row({ state, one, form }: { state: TeachState; one: Characteristic; form: Form }) {
  const words = text.value.teach;
  const shown = language.value;
  const trial = state.values.value.get(one.id);
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
  return (
    <tr data-taught={one.id}>
      <td>
        <strong>{one.id}</strong> <span class="muted">{measureName({ measure: one.measure.type })}</span>
      </td>
      <td class="number nowrap" data-label={words.actual}>
        {trial ? `${decimal(trial.value, 4, shown)} ${unit}` : "–"}
      </td>
      <td class="number nowrap" data-label="U">
        {!trial ? "–" : unit === "mm" ? length(trial.u, shown) : `${decimal(trial.u, 4, shown)} °`}
      </td>
      <td data-label={words.limits}>
        <span class="row end limits">
          {fields.map(([name, label]) => (
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
