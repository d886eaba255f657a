/** Features one by one, and characteristics from several of them. */

import { useSignal } from "@preact/signals";
import { selected } from "../../components/fields/selected";
import { language, text } from "../../text";
import { count } from "../../units";
import {
  COMPOSED,
  type Composed,
  candidates,
  characteristicFrom,
  FEATURE_TYPES,
  type FeatureType,
  featureFrom,
  needsPlane,
  rolesOf,
} from "./composed";
import { idFault } from "./draft";
import type { TeachState } from "./teach_state";

export function ComposedCard({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const { features } = state.plan.value;
  return (
    <details class="card composed">
      <summary>{words.composed}</summary>
      <div class="stack">
        <p class="muted">{words.composed_hint}</p>
        <FeatureForm state={state} />
        {features.length > 0 && <Features state={state} />}
        <CharacteristicForm state={state} />
      </div>
    </details>
  );
}

/** The features of the plan, as they were found on this scan. */
function Features({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const said = new Map(state.trial.answered.value?.said.features.map((feature) => [feature.id, feature]));
  return (
    <ul class="plain features" aria-label={words.features}>
      {state.plan.value.features.map(({ id }) => {
        const found = said.get(id);
        return (
          <li key={id} data-feature={id}>
            <span class="mono">{id}</span>{" "}
            {found?.failure ? (
              <span class="reason" lang="en">
                {found.failure}
              </span>
            ) : (
              <span class="muted">{found ? words.n_points(count(found.n_points, language.value)) : "–"}</span>
            )}
          </li>
        );
      })}
    </ul>
  );
}

function FeatureForm({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const type = useSignal<FeatureType>("plane");
  const id = useSignal("");
  const plane = useSignal("");
  const planes = candidates(state.plan.value, { name: "plane", kinds: ["plane"] });
  const fault = idFault(state.plan.value, id.value);
  const rim = needsPlane(type.value);
  const chosen_plane = plane.value || (planes[0] ?? "");
  const blocked =
    (fault && words.id_faults[fault]) ??
    (rim && chosen_plane === "" ? words.blocked_plane : undefined) ??
    (state.pose_missing ? words.pose_missing : undefined);
  const add = () => {
    state.addFeature((region) => featureFrom(type.peek(), id.peek(), region, chosen_plane));
    id.value = "";
  };
  return (
    <fieldset class="row end" aria-label={words.feature}>
      <label class="field">
        <span>{words.feature}</span>
        <select
          value={type.value}
          onChange={(event) => {
            type.value = selected(event, FEATURE_TYPES) ?? type.value;
          }}
        >
          {FEATURE_TYPES.map((one) => (
            <option key={one} value={one}>
              {words.feature_types[one]}
            </option>
          ))}
        </select>
      </label>
      {rim && (
        <Choice label={words.of_plane} ids={planes} value={chosen_plane} onChange={(id) => (plane.value = id)} />
      )}
      <Name label={words.id} value={id.value} onChange={(value) => (id.value = value)} />
      <AddButton label={words.add_feature} blocked={blocked} onClick={add} />
    </fieldset>
  );
}

function CharacteristicForm({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const composed = useSignal<Composed>("parallelism");
  const id = useSignal("");
  const chosen = useSignal<Readonly<Record<string, string>>>({});
  const made = characteristicFrom(composed.value, id.value, chosen.value);
  const fault = idFault(state.plan.value, id.value);
  const blocked = made ? fault && words.id_faults[fault] : words.blocked_features;
  const add = () => {
    if (made) state.addCharacteristic(made);
    id.value = "";
    chosen.value = {};
  };
  return (
    <fieldset class="row end" aria-label={words.composed_characteristic}>
      <label class="field">
        <span>{words.composed_characteristic}</span>
        <select
          value={composed.value}
          onChange={(event) => {
            composed.value = selected(event, COMPOSED) ?? composed.value;
            chosen.value = {};
          }}
        >
          {COMPOSED.map((one) => (
            <option key={one} value={one}>
              {words.composed_types[one]}
            </option>
          ))}
        </select>
      </label>
      {rolesOf(composed.value).map((role) => (
        <Choice
          key={role.name}
          label={words.roles[role.name] ?? role.name}
          ids={["", ...candidates(state.plan.value, role)]}
          value={chosen.value[role.name] ?? ""}
          onChange={(value) => (chosen.value = { ...chosen.peek(), [role.name]: value })}
        />
      ))}
      <Name label={words.id} value={id.value} onChange={(value) => (id.value = value)} />
      <AddButton label={words.add} blocked={blocked} onClick={add} />
    </fieldset>
  );
}

interface ChoiceProperties {
  label: string;
  ids: readonly string[];
  value: string;
  onChange: (id: string) => void;
}

function Choice({ label, ids, value, onChange }: ChoiceProperties) {
  return (
    <label class="field">
      <span>{label}</span>
      <select value={value} onChange={(event) => onChange(event.currentTarget.value)}>
        {ids.map((id) => (
          <option key={id} value={id}>
            {id}
          </option>
        ))}
      </select>
    </label>
  );
}

function Name({ label, value, onChange }: Omit<ChoiceProperties, "ids">) {
  return (
    <label class="field">
      <span>{label}</span>
      <input
        value={value}
        spellcheck={false}
        autoComplete="off"
        maxLength={60}
        onInput={(event) => onChange(event.currentTarget.value.trim())}
      />
    </label>
  );
}

interface AddProperties {
  label: string;
  blocked: string | undefined;
  onClick: () => void;
}

function AddButton({ label, blocked, onClick }: AddProperties) {
  return (
    <span class="command">
      <button
        type="button"
        aria-disabled={blocked ? "true" : undefined}
        title={blocked}
        onClick={() => !blocked && onClick()}
      >
        {label}
      </button>
      {blocked && <small class="why">{blocked}</small>}
    </span>
  );
}
