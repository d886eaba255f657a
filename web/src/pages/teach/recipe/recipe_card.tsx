/** Which recipe is taught: a new one, or the next version of an existing one. */

import { useEffect } from "preact/hooks";
import { useApp } from "../../../app";
import { Choice } from "../../../components/fields/choice";
import { FileButton } from "../../../components/fields/file_button";
import { TextField } from "../../../components/fields/text_field";
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
          <Choice
            label={words.based_on}
            value={recipe.base.value?.id ?? ""}
            options={[
              ["", words.new_recipe],
              ...items.map((item) => [item.id, `${item.name} · ${versionName(item)}`] as const),
            ]}
            onChange={(id) => void recipe.load.start(id || undefined)}
          />
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
    <TextField
      label={words.recipe_id}
      value={recipe.new_id.value}
      placeholder="bracket"
      spellcheck={false}
      wrong={invalid && words.recipe_id_rule}
      onChange={(typed) => (recipe.new_id.value = typed.trim())}
    />
  );
}

function Name({ recipe: { base, new_id, settings } }: { recipe: RecipeState }) {
  return (
    <TextField
      label={text.value.teach.recipe_name}
      value={settings.name.value}
      placeholder={base.value?.id ?? new_id.value}
      maxLength={100}
      onChange={(name) => (settings.name.value = name)}
    />
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
