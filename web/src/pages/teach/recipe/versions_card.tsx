/** The versions of a recipe: who, when and why, what changed, roll-back, and the file for another station. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Show, useLoaded } from "../../../components/loading/loading";
import { versionName } from "../../../state/records/inspections";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import type { RecipeState } from "./recipe_state";

type Version = Schemas["RecipeVersionDto"];

/** Versions shown, newest first. */
const SHOWN = 50;

export function VersionsCard({ recipe, id }: { recipe: RecipeState; id: string }) {
  const { api } = useApp();
  const words = text.value.teach;
  const newest = recipe.base.value?.version;
  const open = useSignal(false);
  const { state: versions } = useLoaded(
    async () => {
      if (!open.value) return [];
      const params = { path: { id }, query: { limit: SHOWN } };
      return (await data(api.GET("/api/v1/recipes/{id}/versions", { params }))).items;
    },
    [api, id],
    [open.value, newest],
  );
  return (
    <details class="versions" onToggle={(event) => (open.value = event.currentTarget.open)}>
      <summary>{words.versions}</summary>
      <Show of={versions}>
        {(items) => (
          <ol class="plain stack">
            {items.map((version) => (
              <VersionRow
                key={version.version}
                recipe={recipe}
                version={version}
                is_newest={version.version === newest}
              />
            ))}
          </ol>
        )}
      </Show>
    </details>
  );
}

interface RowProperties {
  recipe: RecipeState;
  version: Version;
  is_newest: boolean;
}

function VersionRow({ recipe, version, is_newest }: RowProperties) {
  const words = text.value.teach;
  const { id, version: number } = version;
  const name = versionName(version);
  const roll_back = useMemo(
    () => new Command(() => recipe.rollBack(number, words.rolled_back(name))),
    [recipe, number, words, name],
  );
  return (
    <li class="stack version" data-version={number}>
      <div>
        <strong class="mono">{name}</strong> {version.reason}
        <div class="muted">
          {version.author} · {dateTime(version.created_at_ms, language.value)}
        </div>
      </div>
      <div class="row">
        <a
          class="button"
          href={`/api/v1/recipes/${encodeURIComponent(id)}/versions/${number}/file`}
          download={`${id}-${number}.recipe.json`}
        >
          {words.file}
          <span class="visually-hidden">: {name}</span>
        </a>
        {!is_newest && (
          <CommandButton command={roll_back}>
            {words.roll_back}
            <span class="visually-hidden">: {name}</span>
          </CommandButton>
        )}
      </div>
      {number > 1 && <Changes id={id} to={number} />}
    </li>
  );
}

/** What a version changed. */
function Changes({ id, to }: { id: string; to: number }) {
  const { api } = useApp();
  const words = text.value.teach;
  const open = useSignal(false);
  const { state } = useLoaded(
    async () => {
      if (!open.value) return [];
      const params = { path: { id }, query: { from: to - 1, to } };
      return (await data(api.GET("/api/v1/recipes/{id}/diff", { params }))).changes;
    },
    [api, id, to],
    [open.value],
  );
  return (
    <details onToggle={(event) => (open.value = event.currentTarget.open)}>
      <summary>{words.changes(versionName({ id, version: to }))}</summary>
      <Show of={state}>
        {(changes) => (
          <ul class="plain changes">
            {changes.map(({ place, old, new: now }) => (
              <li key={place} class="mono">
                {place}: {old ?? "–"} → {now ?? "–"}
              </li>
            ))}
          </ul>
        )}
      </Show>
    </details>
  );
}
