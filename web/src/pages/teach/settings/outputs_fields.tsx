/** The doors that receive the results of the recipe. */

import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { Check } from "../../../components/fields/check";
import { Show, useLoaded } from "../../../components/loading/loading";
import type { Door } from "../../../state/records/doors";
import { text } from "../../../text";
import type { RecipeSettings } from "./recipe_settings";

interface Properties {
  settings: RecipeSettings;
}

export function OutputsFields({ settings }: Properties) {
  const { api } = useApp();
  const words = text.value.recipe_settings;
  const { state } = useLoaded(async () => (await data(api.GET("/api/v1/doors"))).items, [api]);
  return (
    <fieldset class="stack">
      <legend>{words.outputs}</legend>
      <Show of={state}>{(doors) => <Outputs settings={settings} doors={doors} />}</Show>
    </fieldset>
  );
}

function Outputs({ settings, doors }: Properties & { doors: readonly Door[] }) {
  const words = text.value.recipe_settings;
  const outputs = settings.outputs.value;
  if (!outputs && doors.length === 0) return <p class="muted">{words.no_doors}</p>;
  return (
    <>
      <Check
        label={words.every_door}
        checked={outputs === undefined}
        onChange={(checked) => {
          // All are selected at first, so that no result is withheld by mistake.
          settings.outputs.value = checked ? undefined : doors.map(({ name }) => name);
        }}
      />
      {outputs && (
        <>
          <Selected settings={settings} outputs={outputs} doors={doors} />
          {outputs.length === 0 && <p class="note">{words.no_output}</p>}
          <p class="muted">{words.outputs_hint}</p>
        </>
      )}
    </>
  );
}

function Selected({
  settings,
  outputs,
  doors,
}: Properties & { outputs: readonly string[]; doors: readonly Door[] }) {
  const words = text.value.recipe_settings;
  const unknown = outputs.filter((name) => !doors.some((door) => door.name === name));
  return (
    <ul class="plain outputs">
      {doors.map(({ name, kind }) => (
        <li key={name}>
          <Check
            label={
              <span>
                <span class="mono">{name}</span> <span class="muted">{text.value.doors.kinds[kind] ?? kind}</span>
              </span>
            }
            checked={outputs.includes(name)}
            onChange={(checked) => settings.setOutput(name, checked)}
          />
        </li>
      ))}
      {unknown.map((name) => (
        <li key={name} class="row" data-unknown-door={name}>
          <span class="mono">{name}</span>
          <span>{words.unknown_door}</span>
          <button
            type="button"
            aria-label={text.value.teach.remove_named(name)}
            onClick={() => settings.setOutput(name, false)}
          >
            {text.value.teach.remove}
          </button>
        </li>
      ))}
    </ul>
  );
}
