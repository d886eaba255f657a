/** Deliveries that a door has set aside, oldest first, with commands to resend or delete them. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { DamagedRecords } from "../../../components/dialogs/damaged";
import { DeleteDialog } from "../../../components/dialogs/delete_dialog";
import { Show, useLoaded } from "../../../components/loading/loading";
import { relativeTime, useNow } from "../../../components/relative_time";
import { type Delivery, type Door, readDeliveries, type SetAside } from "../../../state/records/doors";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { eventName, number, setAside } from "./door_facts";

/** Deliveries shown at first and added by "Show more". */
const AT_ONCE = 50;

interface Properties {
  door: Door;
  /** Reloads the doors, and thereby this list. */
  reload: () => Promise<void>;
}

export function Deliveries({ door, reload }: Properties) {
  const words = text.value.doors;
  const open = useSignal(false);
  return (
    <details class="deliveries" onToggle={(event) => (open.value = event.currentTarget.open)}>
      <summary>{words.deliveries(number(setAside(door)))}</summary>
      {open.value && <List door={door} reload={reload} />}
    </details>
  );
}

function List({ door, reload }: Properties) {
  const { api } = useApp();
  const shown = useSignal(AT_ONCE);
  // The door is reloaded every few seconds and after its events.
  const { state } = useLoaded(() => readDeliveries(api, door.name, shown.value), [door.name], [shown.value, door]);
  return (
    <Show of={state}>
      {(set_aside) => (
        <div class="stack">
          <p class="muted">{text.value.doors.deliveries_hint}</p>
          <DamagedRecords rows={set_aside.damaged} />
          <Table door={door} reload={reload} set_aside={set_aside} />
          {set_aside.has_more && (
            <div>
              <button type="button" onClick={() => (shown.value += AT_ONCE)}>
                {text.value.doors.more}
              </button>
            </div>
          )}
        </div>
      )}
    </Show>
  );
}

function Table({ door, reload, set_aside }: Properties & { set_aside: SetAside }) {
  const words = text.value.doors;
  const deleting = useSignal<Delivery | undefined>(undefined);
  if (set_aside.items.length === 0) return <p>{words.no_deliveries}</p>;
  return (
    <>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.event}</th>
            <th>{words.state}</th>
            <th class="number">{words.n_attempts}</th>
            <th>{words.next}</th>
            <th>{words.reason}</th>
            <th>
              <span class="visually-hidden">{words.actions}</span>
            </th>
          </tr>
        </thead>
        <tbody>
          {set_aside.items.map((delivery) => (
            <Row
              key={delivery.event.seq}
              door={door.name}
              delivery={delivery}
              reload={reload}
              onDelete={() => (deleting.value = delivery)}
            />
          ))}
        </tbody>
      </table>
      {deleting.value && (
        <Delete
          door={door.name}
          delivery={deleting.value}
          reload={reload}
          onClose={() => (deleting.value = undefined)}
        />
      )}
    </>
  );
}

interface RowProperties {
  /** Name of the door. */
  door: string;
  delivery: Delivery;
  reload: () => Promise<void>;
}

function Row({ door, delivery, reload, onDelete }: RowProperties & { onDelete: () => void }) {
  const { api } = useApp();
  const words = text.value.doors;
  const { event, state } = delivery;
  const seq = String(event.seq);
  const resend = useMemo(
    () =>
      new Command(async () => {
        const params = { path: { name: door, seq: event.seq } };
        await data(api.POST("/api/v1/doors/{name}/deliveries/{seq}/resend", { params }));
        await reload();
      }),
    [api, door, event.seq],
  );
  return (
    <tr data-delivery={seq} data-delivery-state={state}>
      <td>
        <strong>{seq}</strong> · {eventName(event.kind)}
        <div class="muted">{dateTime(event.at_ms, language.value)}</div>
      </td>
      <td data-label={words.state}>
        <span class={state === "dead" ? "tag bad" : "tag"}>
          {state === "dead" && <span aria-hidden="true">✕ </span>}
          {words.delivery_states[state]}
        </span>
      </td>
      <td data-label={words.n_attempts} class="number">
        {number(delivery.n_attempts)}
      </td>
      <td data-label={words.next}>
        <Next at_ms={delivery.next_at_ms} />
      </td>
      <td data-label={words.reason} class="reason" lang="en">
        {delivery.reason}
      </td>
      <td>
        <span class="row">
          <CommandButton command={resend}>
            {words.resend} <span class="visually-hidden">{words.named(seq)}</span>
          </CommandButton>
          <button type="button" onClick={onDelete}>
            {words.delete} <span class="visually-hidden">{words.named(seq)}</span>
          </button>
        </span>
      </td>
    </tr>
  );
}

function Next({ at_ms }: { at_ms: number | null | undefined }) {
  const now_ms = useNow();
  if (at_ms == null) return <>–</>;
  return (
    <span title={dateTime(at_ms, language.value)}>
      {relativeTime(Math.max(at_ms, now_ms), now_ms, language.value)}
    </span>
  );
}

function Delete({ door, delivery, reload, onClose }: RowProperties & { onClose: () => void }) {
  const { api } = useApp();
  const words = text.value.doors;
  const { seq, kind } = delivery.event;
  const remove = useMemo(
    () =>
      new Command(async () => {
        const params = { path: { name: door, seq } };
        await data(api.DELETE("/api/v1/doors/{name}/deliveries/{seq}", { params }));
        onClose();
        await reload();
      }),
    [api, door, seq],
  );
  return (
    <DeleteDialog
      title={words.delete_title}
      question={words.delete_question(String(seq), eventName(kind), door)}
      remove={remove}
      onClose={onClose}
    />
  );
}
