/** Publishing: which recipe, why, and what follows. */

import { useEffect } from "preact/hooks";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { FileButton } from "../../components/fields/file_button";
import type { Form } from "../../components/fields/form";
import { Show, useLoaded } from "../../components/loading/loading";
import { ProblemCard } from "../../components/problem";
import { href } from "../../state/browser/route";
import { versionName } from "../../state/records/inspections";
import { readRecipes } from "../../state/records/recipes";
import { text } from "../../text";
import type { TeachState } from "./teach_state";
import { VersionsCard } from "./versions_card";

/** Ids that the server accepts. */
const ID = /^[a-z][a-z0-9_-]{0,63}$/;

export function RecipeCard({ state }: { state: TeachState }) {
  const { api } = useApp();
  const words = text.value.teach;
  const { state: recipes } = useLoaded(() => readRecipes(api), [api], [state.published.value]);
  const wanted = state.inspection?.recipe.id;
  const problem = state.load.problem.value;
  useEffect(() => {
    if (wanted !== undefined) void state.load.start(wanted);
  }, [state, wanted]);
  return (
    <section class="card stack" aria-label={words.recipe}>
      <h2>{words.recipe}</h2>
      <Show of={recipes}>
        {({ items }) => (
          <label class="field">
            <span>{words.based_on}</span>
            <select
              value={state.base.value?.id ?? ""}
              onChange={(event) => void state.load.start(event.currentTarget.value || undefined)}
            >
              <option value="">{words.new_recipe}</option>
              {items.map(({ id, name, version }) => (
                <option key={id} value={id}>
                  {name} · {versionName({ id, version })}
                </option>
              ))}
            </select>
          </label>
        )}
      </Show>
      {problem && <ProblemCard problem={problem} onDismiss={() => state.load.dismiss()} />}
      {state.base.value ? (
        <VersionsCard state={state} id={state.base.value.id} />
      ) : (
        <>
          <NewRecipe state={state} />
          <ImportButton state={state} />
        </>
      )}
    </section>
  );
}

function ImportButton({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const problem = state.import_file.problem.value;
  return (
    <>
      <FileButton label={words.import_file} accept=".json" onFile={(file) => void state.import_file.start(file)} />
      {problem && <ProblemCard problem={problem} onDismiss={() => state.import_file.dismiss()} />}
    </>
  );
}

function NewRecipe({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const invalid = state.new_id.value !== "" && !ID.test(state.new_id.value);
  return (
    <div class="row end">
      <label class="field">
        <span>{words.recipe_id}</span>
        <input
          value={state.new_id.value}
          placeholder="bracket"
          spellcheck={false}
          autoComplete="off"
          aria-invalid={invalid ? "true" : undefined}
          onInput={(event) => {
            state.new_id.value = event.currentTarget.value.trim();
          }}
        />
        {invalid && <span class="wrong">{words.recipe_id_rule}</span>}
      </label>
      <label class="field">
        <span>{words.recipe_name}</span>
        <input
          value={state.name.value}
          maxLength={100}
          autoComplete="off"
          onInput={(event) => {
            state.name.value = event.currentTarget.value;
          }}
        />
      </label>
    </div>
  );
}

export function PublishCard({ state, form }: { state: TeachState; form: Form }) {
  const words = text.value.teach;
  const blocked =
    state.plan.value.characteristics.length === 0
      ? words.plan_empty
      : !state.base.value && !ID.test(state.new_id.value)
        ? words.blocked_id
        : state.reason.value.trim() === ""
          ? words.blocked_reason
          : form.blocked.value;
  return (
    <section class="card stack" aria-label={words.publish}>
      <h2>{words.publish}</h2>
      <p class="muted">{words.publish_hint}</p>
      <div class="row end">
        <label class="field grow">
          <span>{words.reason}</span>
          <input
            value={state.reason.value}
            maxLength={100}
            autoComplete="off"
            onInput={(event) => {
              state.reason.value = event.currentTarget.value;
            }}
          />
        </label>
        <CommandButton command={state.publish} kind="primary" blocked={blocked}>
          {words.publish}
        </CommandButton>
      </div>
      {state.published.value && <Published state={state} />}
    </section>
  );
}

function Published({ state }: { state: TeachState }) {
  const words = text.value.teach;
  const version = state.published.value;
  if (!version) return null;
  return (
    <div class="stack" role="status" data-published={versionName(version)}>
      <p>
        {words.published(versionName(version), version.author)} <a href={href("operate")}>{words.to_operate}</a>
      </p>
      {state.inspection && (
        <CommandButton command={state.evaluate}>{words.evaluate(state.inspection.serial)}</CommandButton>
      )}
    </div>
  );
}
