/** Features one by one, and characteristics from several of them. */

import { useSignal } from "@preact/signals";
import { Choice } from "../../components/fields/choice";
import { ReasonedButton } from "../../components/reasoned_button";
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
import { IdField } from "./id_field";
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
    state.pose_blocked.value;
  const add = () => {
    state.addFeature((region) => featureFrom(type.peek(), id.peek(), region, chosen_plane));
    id.value = "";
  };
  return (
    <fieldset class="row end" aria-label={words.feature}>
      <Choice
        label={words.feature}
        value={type.value}
        options={FEATURE_TYPES.map((one) => [one, words.feature_types[one]])}
        onChange={(one) => (type.value = one)}
      />
      {rim && (
        <Choice
          label={words.of_plane}
          value={chosen_plane}
          options={planes.map((id) => [id, id])}
          onChange={(id) => (plane.value = id)}
        />
      )}
      <IdField id={id} />
      <ReasonedButton label={words.add_feature} blocked={blocked} onClick={add} />
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
  const blocked =
    composed.value.startsWith("coordinate") && !state.plan.value.alignment
      ? words.blocked_unaligned
      : made
        ? fault && words.id_faults[fault]
        : words.blocked_features;
  const add = () => {
    if (made) state.addCharacteristic(made);
    id.value = "";
    chosen.value = {};
  };
  return (
    <fieldset class="row end" aria-label={words.composed_characteristic}>
      <Choice
        label={words.composed_characteristic}
        value={composed.value}
        options={COMPOSED.map((one) => [one, words.composed_types[one]])}
        onChange={(one) => {
          composed.value = one;
          chosen.value = {};
        }}
      />
      {rolesOf(composed.value).map((role) => (
        <Choice
          key={role.name}
          label={words.roles[role.name] ?? role.name}
          value={chosen.value[role.name] ?? ""}
          options={["", ...candidates(state.plan.value, role)].map((id) => [id, id])}
          onChange={(value) => (chosen.value = { ...chosen.peek(), [role.name]: value })}
        />
      ))}
      <IdField id={id} />
      <ReasonedButton label={words.add} blocked={blocked} onClick={add} />
    </fieldset>
  );
}
