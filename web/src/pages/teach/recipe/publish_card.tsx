/** Publishing: why, and what follows. */

import { CommandButton } from "../../../components/command_button";
import type { Form } from "../../../components/fields/form";
import { TextField } from "../../../components/fields/text_field";
import { href } from "../../../state/browser/route";
import { versionName } from "../../../state/records/inspections";
import { text } from "../../../text";
import type { TeachState } from "../teach_state";
import { isRecipeId } from "./recipe_card";
import type { RecipeState } from "./recipe_state";

export function PublishCard({ state, form }: { state: TeachState; form: Form }) {
  const words = text.value.teach;
  const { recipe } = state;
  return (
    <section class="card stack" aria-label={words.publish}>
      <h2>{words.publish}</h2>
      <p class="muted">{words.publish_hint}</p>
      <div class="row end">
        <TextField
          class="grow"
          label={words.reason}
          value={recipe.reason.value}
          maxLength={100}
          onChange={(reason) => (recipe.reason.value = reason)}
        />
        <CommandButton command={recipe.publish} kind="primary" blocked={blockedPublish(state, form)}>
          {words.publish}
        </CommandButton>
      </div>
      {recipe.published.value && <Published recipe={recipe} />}
    </section>
  );
}

/** Why the recipe cannot be published now. */
function blockedPublish({ plan, recipe }: TeachState, form: Form): string | undefined {
  const words = text.value.teach;
  if (plan.value.characteristics.length === 0) return words.plan_empty;
  if (!recipe.base.value && !isRecipeId(recipe.new_id.value)) return words.blocked_id;
  if (recipe.reason.value.trim() === "") return words.blocked_reason;
  if (form.blocked.value) return form.blocked.value;
  const fault = recipe.settings.fault.value;
  return fault && text.value.recipe_settings.faults[fault];
}

function Published({ recipe }: { recipe: RecipeState }) {
  const words = text.value.teach;
  const version = recipe.published.value;
  if (!version) return null;
  return (
    <div class="stack" role="status" data-published={versionName(version)}>
      <p>
        {words.published(versionName(version), version.author)} <a href={href("operate")}>{words.to_operate}</a>
      </p>
      {recipe.inspection && (
        <CommandButton command={recipe.evaluate}>{words.evaluate(recipe.inspection.serial)}</CommandButton>
      )}
    </div>
  );
}
