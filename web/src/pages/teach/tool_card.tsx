/** One characteristic: region, tool, its value on this scan, and limits. */

import { CommandButton } from "../../components/command_button";
import { useForm } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { selected } from "../../components/fields/selected";
import { language, text } from "../../text";
import { count, decimal, length } from "../../units";
import { MEASURED_BY, TAUGHT } from "./draft";
import type { TeachState, Trial } from "./teach_state";

/** Decimals of a proposed nominal value: drawings rarely state more. */
const NOMINAL_DIGITS = 2;

/** Found above the largest plane of the region. */
const ON_TABLE = /^(sphere|cylinder)_/;

export function ToolCard({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const form = useForm();
  const taught = state.taught.value;
  const at_once = MEASURED_BY[taught] !== undefined;
  const unit = taught === "angle" ? "°" : "mm";
  const { nominal, lower, upper } = state.limits.value;
  const change = (part: Partial<typeof state.limits.value>) => {
    state.limits.value = { ...state.limits.peek(), ...part };
  };
  return (
    <section class="card stack" aria-label={words.characteristic}>
      <h2>{words.characteristic}</h2>
      <p class="muted">{state.result.view.region.value ? words.region_set : words.region_none}</p>
      <div class="row end">
        <label class="field">
          <span>{words.tool}</span>
          <select
            value={taught}
            onChange={(event) => state.choose(selected(event, TAUGHT) ?? state.taught.peek())}
          >
            {TAUGHT.map((one) => (
              <option key={one} value={one}>
                {words.tools[one]}
              </option>
            ))}
          </select>
        </label>
        {at_once && (
          <CommandButton command={state.measure} kind="primary" blocked={!state.scan.cloud && words.no_cloud}>
            {words.measure}
          </CommandButton>
        )}
      </div>
      {!at_once && <p class="note">{words.not_at_once}</p>}
      {state.result.view.region.value && ON_TABLE.test(taught) && <p class="muted">{words.with_table}</p>}
      {state.trial.value && <TrialFacts trial={state.trial.value} />}
      <div class="row end">
        <label class="field">
          <span>{words.id}</span>
          <input
            value={state.id.value}
            spellcheck={false}
            autoComplete="off"
            maxLength={60}
            onInput={(event) => {
              state.id.value = event.currentTarget.value.trim();
            }}
          />
        </label>
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
        {state.trial.value?.value !== undefined && (
          <button
            type="button"
            onClick={() => change({ nominal: Number(state.trial.peek()?.value?.toFixed(NOMINAL_DIGITS)) })}
          >
            {words.take_nominal}
          </button>
        )}
      </div>
      <Add state={state} fault={form.blocked.value} at_once={at_once} />
    </section>
  );
}

function Add({ state, fault, at_once }: { state: TeachState; fault: string | undefined; at_once: boolean }) {
  const words = text.value.teach;
  const id_fault = state.id_fault.value;
  const needs_trial = at_once && state.trial.value?.value === undefined;
  const blocked = needs_trial
    ? words.blocked_measure
    : id_fault
      ? words.id_faults[id_fault]
      : (fault ?? (state.pose_missing ? words.pose_missing : undefined));
  return (
    <div class="command">
      <button
        type="button"
        aria-disabled={blocked ? "true" : undefined}
        title={blocked}
        onClick={() => !blocked && state.add()}
      >
        {words.add}
      </button>
      {blocked && <small class="why">{blocked}</small>}
    </div>
  );
}

function TrialFacts({ trial }: { trial: Trial }) {
  const words = text.value.teach;
  const shown = language.value;
  const { measurement, value, u, unit } = trial;
  const { features, notes, uncertainty_complete, uncertainty_missing = [] } = measurement.result;
  const n_points = features.reduce((sum, feature) => sum + feature.n_points, 0);
  return (
    <div class="stack trial" data-trial={measurement.request.tool} role="status">
      <dl class="facts">
        <dt>{words.actual}</dt>
        <dd>
          <strong class="big-value">
            {value === undefined ? words.not_found : `${decimal(value, 4, shown)} ${unit}`}
          </strong>
        </dd>
        <dt>U (k = 2)</dt>
        <dd>{unit === "mm" ? length(u, shown) : `${decimal(u, 4, shown)} °`}</dd>
        <dt>{words.points}</dt>
        <dd>{count(n_points, shown)}</dd>
      </dl>
      {uncertainty_complete === false && (
        <p class="note">
          {text.value.inspections.incomplete} <span lang="en">{uncertainty_missing.join(", ")}</span>
        </p>
      )}
      {notes.map((note) => (
        <p key={note} class="muted" lang="en">
          {note}
        </p>
      ))}
    </div>
  );
}
