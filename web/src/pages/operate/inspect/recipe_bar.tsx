/** The recipe and version that Start uses, and hold and resume of the queue of inspections. */

import type { ComponentChildren } from "preact";
import { useId, useRef } from "preact/hooks";
import type { Recipe } from "../../../state/records/recipes";
import { text } from "../../../text";
import { BY_SERIAL, type Choice, SCAN_ONLY, storedChoice, versionsOf } from "./choice";

interface Properties {
  recipes: readonly Recipe[];
  choice: Choice;
  /** Called with the choice as it is stored. */
  onChoose: (stored: string) => void;
  /** State and buttons of the queue. */
  children: ComponentChildren;
}

export function RecipeBar({ recipes, choice, onChoose, children }: Properties) {
  const words = text.value.operate;
  const id = useId();
  const by_pointer = useRef(false);
  const chosen = choice.kind === "recipe" ? choice.recipe.id : storedChoice(choice);
  const version = choice.kind === "recipe" ? choice.version : undefined;
  const choose = (stored: string) => {
    onChoose(stored);
    // By keys the list keeps the focus, since each arrow key changes the selection.
    if (by_pointer.current) document.getElementById("serial")?.focus({ preventScroll: true });
  };
  const list = {
    "data-yields": true,
    onPointerDown: () => (by_pointer.current = true),
    onKeyDown: (event: KeyboardEvent) => {
      by_pointer.current = false;
      if (event.key === "Enter") document.getElementById("serial")?.focus();
    },
  };
  return (
    <div class="card row end recipe-bar">
      <div class="field">
        <label for={`${id}-recipe`}>{words.recipe}</label>
        <select
          id={`${id}-recipe`}
          {...list}
          value={chosen}
          onChange={(event) => choose(event.currentTarget.value)}
        >
          {choice.kind === "none" && <option value="">{words.choose_recipe}</option>}
          {recipes.some(({ serial_pattern }) => serial_pattern != null) && (
            <option value={BY_SERIAL}>{words.recipe_by_serial}</option>
          )}
          {recipes.map((recipe) => (
            <option key={recipe.id} value={recipe.id}>
              {recipe.name === recipe.id ? recipe.id : `${recipe.name} (${recipe.id})`}
            </option>
          ))}
          <option value={SCAN_ONLY}>{words.without_recipe}</option>
        </select>
      </div>
      {choice.kind === "recipe" && (
        <div class="field">
          <label for={`${id}-version`}>{words.version}</label>
          <select
            id={`${id}-version`}
            {...list}
            value={version ?? ""}
            onChange={(event) => choose([choice.recipe.id, event.currentTarget.value].filter(Boolean).join("@"))}
          >
            <option value="">{words.newest_version(choice.recipe.version)}</option>
            {versionsOf(choice.recipe).map((number) => (
              <option key={number} value={number}>
                {words.this_version(number)}
              </option>
            ))}
          </select>
        </div>
      )}
      {choice.kind === "recipe" && version !== undefined && version < choice.recipe.version && (
        <p class="note">{words.older_version(choice.recipe.version)}</p>
      )}
      {children}
    </div>
  );
}
