/** Which recipe is taught: a new one, or the next version of an existing one. */

import { useEffect } from "preact/hooks";
import { useApp } from "../../../app";
import { FileButton } from "../../../components/fields/file_button";
import { Show, useLoaded } from "../../../components/loading/loading";
import { ProblemCard } from "../../../components/problem";
import { versionName } from "../../../state/records/inspections";
import { readRecipes } from "../../../state/records/recipes";
import { text } from "../../../text";
import type { RecipeState } from "./recipe_state";
import { VersionsCard } from "./versions_card";

/** Ids that the server accepts. */
const ID = /^[a-z][a-z0-9_-]{0,63}$/;

export function isRecipeId(id: string): boolean {
  return ID.test(id);
}

export function RecipeCard({ recipe }: { recipe: RecipeState }) {
  const { api } = useApp();
  const words = text.value.teach;
  const { state: recipes } = useLoaded(() => readRecipes(api), [api], [recipe.published.value]);
  const wanted = recipe.inspection?.recipe.id;
  const problem = recipe.load.problem.value;
  useEffect(() => {
    if (wanted !== undefined) void recipe.load.start(wanted);
  }, [recipe, wanted]);
  return (
    <section class="card stack" aria-label={words.recipe}>
      <h2>{words.recipe}</h2>
      <Show of={recipes}>
        {({ items }) => (
          <label class="field">
            <span>{words.based_on}</span>
            <select
              value={recipe.base.value?.id ?? ""}
              onChange={(event) => void recipe.load.start(event.currentTarget.value || undefined)}
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
      {problem && <ProblemCard problem={problem} onDismiss={() => recipe.load.dismiss()} />}
      <div class="row end">
        {!recipe.base.value && <NewId recipe={recipe} />}
        <Name recipe={recipe} />
      </div>
      {recipe.base.value ? (
        <VersionsCard recipe={recipe} id={recipe.base.value.id} />
      ) : (
        <ImportButton recipe={recipe} />
      )}
    </section>
  );
}

function NewId({ recipe }: { recipe: RecipeState }) {
  const words = text.value.teach;
  const invalid = recipe.new_id.value !== "" && !isRecipeId(recipe.new_id.value);
  return (
    <label class="field">
      <span>{words.recipe_id}</span>
      <input
        value={recipe.new_id.value}
        placeholder="bracket"
        spellcheck={false}
        autoComplete="off"
        aria-invalid={invalid ? "true" : undefined}
        onInput={(event) => {
          recipe.new_id.value = event.currentTarget.value.trim();
        }}
      />
      {invalid && <span class="wrong">{words.recipe_id_rule}</span>}
    </label>
  );
}

function Name({ recipe: { base, new_id, settings } }: { recipe: RecipeState }) {
  return (
    <label class="field">
      <span>{text.value.teach.recipe_name}</span>
      <input
        value={settings.name.value}
        placeholder={base.value?.id ?? new_id.value}
        maxLength={100}
        autoComplete="off"
        onInput={(event) => {
          settings.name.value = event.currentTarget.value;
        }}
      />
    </label>
  );
}

function ImportButton({ recipe }: { recipe: RecipeState }) {
  const words = text.value.teach;
  const problem = recipe.import_file.problem.value;
  return (
    <>
      <FileButton
        label={words.import_file}
        accept=".json"
        onFile={(file) => void recipe.import_file.start(file)}
      />
      {problem && <ProblemCard problem={problem} onDismiss={() => recipe.import_file.dismiss()} />}
    </>
  );
}
