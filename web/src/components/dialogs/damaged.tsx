/** Lists damaged records with cause and remedy. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import type { Damaged } from "../../state/records/damaged";
import { Command } from "../../state/station/command";
import { text } from "../../text";
import { DeleteDialog } from "./delete_dialog";

/** Renders nothing if no record is damaged. */
export function DamagedRecords({ rows }: { rows: readonly Damaged[] }) {
  const words = text.value.damaged;
  const deleting = useSignal<Damaged | undefined>(undefined);
  if (rows.length === 0) return null;
  const deletable = rows.some(isDeletable);
  return (
    <section class="problem stack damaged" aria-label={words.title(rows.length)}>
      <strong>{words.title(rows.length)}</strong>
      <ul class="plain stack">
        {rows.map((row) => (
          <li key={`${row.kind} ${row.id}`} class="row" data-damaged={row.id}>
            <span>
              {words.kinds[row.kind] ?? row.kind} <span class="mono">{row.id}</span>
            </span>
            {isDeletable(row) && (
              <button type="button" onClick={() => (deleting.value = row)} aria-label={words.delete_named(row.id)}>
                {text.value.results.delete}
              </button>
            )}
          </li>
        ))}
      </ul>
      <div>{words.hint}</div>
      <div>
        {text.value.common.remedy}: {deletable ? words.remedy_delete : words.remedy}
      </div>
      {deleting.value && <Delete row={deleting.value} onClose={() => (deleting.value = undefined)} />}
    </section>
  );
}

/** Only results can be deleted; the API has no deletion for other records. */
function isDeletable({ kind }: Damaged): boolean {
  return kind === "scan";
}

function Delete({ row, onClose }: { row: Damaged; onClose: () => void }) {
  const { api } = useApp();
  const remove = useMemo(
    () =>
      new Command(async () => {
        await data(api.DELETE("/api/v1/scans/{id}", { params: { path: { id: row.id } } }));
        onClose();
      }),
    [api, row.id, onClose],
  );
  return (
    <DeleteDialog
      title={text.value.results.delete_title}
      question={text.value.damaged.delete_question(row.id)}
      remove={remove}
      onClose={onClose}
    />
  );
}
