/** The settings of the recipe beside its plan: which parts it is for, how it scans, and where its results go. */

import { useId } from "preact/hooks";
import type { Form } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { text } from "../../../text";
import { AttributesFields } from "./attributes_fields";
import { OutputsFields } from "./outputs_fields";
import type { RecipeSettings } from "./recipe_settings";
import { ScanFields } from "./scan_fields";
import "./settings.css";

/** Largest number of a recipe: 32 bits at the interfaces for PLCs. */
const MAX_NUMBER = 2 ** 32 - 1;

interface Properties {
  settings: RecipeSettings;
  form: Form;
}

export function SettingsCard({ settings, form }: Properties) {
  const words = text.value.recipe_settings;
  return (
    <details class="card recipe-settings">
      <summary>{words.card}</summary>
      <div class="stack" key={settings.n_starts.value}>
        <p class="muted">{words.hint}</p>
        <Selection settings={settings} form={form} />
        <ScanFields settings={settings} form={form} />
        <OutputsFields settings={settings} />
        <AttributesFields settings={settings} />
      </div>
    </details>
  );
}

/** By what the recipe is selected for a part. */
function Selection({ settings, form }: Properties) {
  const words = text.value.recipe_settings;
  const id = useId();
  const wrong = settings.pattern_is_broken.value;
  return (
    <fieldset class="stack">
      <legend>{words.selection}</legend>
      <div class="row end">
        <NumberField
          form={form}
          label={words.number}
          unit=""
          optional
          whole
          min={1}
          max={MAX_NUMBER}
          value={settings.number.value}
          onChange={(value) => {
            settings.number.value = value;
          }}
        />
        <div class="field pattern">
          <label for={id}>{words.serial_pattern}</label>
          <input
            id={id}
            class="mono"
            value={settings.serial_pattern.value}
            placeholder="BR-[0-9]{4}"
            spellcheck={false}
            autoComplete="off"
            aria-invalid={wrong ? "true" : undefined}
            aria-describedby={wrong ? `${id}-wrong ${id}-hint` : `${id}-hint`}
            onInput={(event) => {
              settings.serial_pattern.value = event.currentTarget.value;
            }}
          />
          {wrong && (
            <span class="wrong" id={`${id}-wrong`}>
              {words.faults.broken_pattern}
            </span>
          )}
        </div>
      </div>
      <p class="muted" id={`${id}-hint`}>
        {words.selection_hint}
      </p>
    </fieldset>
  );
}
