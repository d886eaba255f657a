/** What a new measurement system analysis examines: recipe, characteristic, parts, repetitions. */

import { useEffect } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { Choice } from "../../../components/fields/choice";
import { NumberField } from "../../../components/fields/number_field";
import { TextField } from "../../../components/fields/text_field";
import { Show, useLoaded } from "../../../components/loading/loading";
import { readRecipes } from "../../../state/records/recipes";
import { text } from "../../../text";
import type { DraftForm } from "./new_study";
import type { Draft } from "./plan";

export function Type1Form({ form, draft }: DraftForm) {
  const words = text.value.studies;
  const change = (part: Partial<Draft>) => (draft.value = { ...draft.peek(), ...part });
  const { serial, reference, n_values } = draft.value;
  return (
    <div class="row end">
      <CharacteristicFields form={form} draft={draft} />
      <TextField label={words.serial} value={serial} maxLength={100} onChange={(serial) => change({ serial })} />
      <NumberField
        form={form}
        label={words.reference}
        unit=""
        value={reference}
        optional
        onChange={(value) => change({ reference: value })}
      />
      <NumberField
        form={form}
        label={words.n_values}
        unit=""
        value={n_values}
        min={50}
        max={500}
        whole
        onChange={(value) => change({ n_values: value ?? 50 })}
      />
    </div>
  );
}

export function GaugeRrForm({ form, draft }: DraftForm) {
  const words = text.value.studies;
  const change = (part: Partial<Draft>) => (draft.value = { ...draft.peek(), ...part });
  const { parts, operators, n_trials } = draft.value;
  return (
    <>
      <div class="row end">
        <CharacteristicFields form={form} draft={draft} />
        <TextField class="long" label={words.parts} value={parts} onChange={(parts) => change({ parts })} />
        <TextField
          class="long"
          label={words.operators}
          value={operators}
          onChange={(operators) => change({ operators })}
        />
        <NumberField
          form={form}
          label={words.n_trials}
          unit=""
          value={n_trials}
          min={2}
          max={500}
          whole
          onChange={(value) => change({ n_trials: value ?? 3 })}
        />
      </div>
      <p class="muted">{words.operators_hint}</p>
    </>
  );
}

/** Recipe and characteristic; the first ones until others are chosen. */
function CharacteristicFields({ draft }: DraftForm) {
  const { api } = useApp();
  const words = text.value.studies;
  const recipes = useLoaded(() => readRecipes(api), [api]);
  const change = (part: Partial<Draft>) => (draft.value = { ...draft.peek(), ...part });
  const { recipe, characteristic } = draft.value;
  const first = recipes.state.value.value?.items[0]?.id;
  useEffect(() => {
    if (draft.peek().recipe === "" && first !== undefined) change({ recipe: first, characteristic: "" });
  }, [first]);
  const known = useLoaded(async () => {
    if (recipe === "") return [];
    const newest = await data(api.GET("/api/v1/recipes/{id}", { params: { path: { id: recipe } } }));
    return newest.recipe.plan.characteristics.map(({ id }) => id);
  }, [api, recipe]);
  const one = known.state.value.value?.[0];
  useEffect(() => {
    if (draft.peek().characteristic === "" && one !== undefined) change({ characteristic: one });
  }, [one]);
  return (
    <Show of={recipes.state}>
      {({ items }) =>
        items.length === 0 ? (
          <p>{words.no_recipes}</p>
        ) : (
          <>
            <Choice
              label={words.recipe}
              value={recipe}
              options={items.map(({ id, name }) => [id, name])}
              onChange={(recipe) => change({ recipe, characteristic: "" })}
            />
            <Choice
              label={words.characteristic}
              value={characteristic}
              options={(known.state.value.value ?? []).map((id) => [id, id])}
              onChange={(characteristic) => change({ characteristic })}
            />
          </>
        )
      }
    </Show>
  );
}
