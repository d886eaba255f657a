/** The events, newest first, updated live. */

import { useMemo } from "preact/hooks";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { DamagedRecords } from "../../components/dialogs/damaged";
import type { StationEvent } from "../../state/records/events";
import { Command } from "../../state/station/command";
import { language, text } from "../../text";
import { dateTime } from "../../units";
import { eventActor, eventDetail } from "./event_text";

export function EventTable() {
  const { events } = useApp();
  const words = text.value.health;
  const older = useMemo(() => new Command(() => events.older()), [events]);
  const list = events.list.value;
  return (
    <section class="card" aria-label={words.events}>
      <h2>{words.events}</h2>
      <DamagedRecords rows={events.damaged.value} />
      {list.length === 0 && <p class="muted">{words.no_events}</p>}
      {list.length > 0 && (
        <table class="wide events">
          <thead>
            <tr>
              <th class="number">{words.number}</th>
              <th>{words.when}</th>
              <th>{words.event}</th>
              <th>{words.subject}</th>
            </tr>
          </thead>
          <tbody>
            {list.map((event) => (
              <Row key={event.seq} event={event} />
            ))}
          </tbody>
        </table>
      )}
      {events.hasOlder && <CommandButton command={older}>{words.older_events}</CommandButton>}
    </section>
  );
}

function Row({ event }: { event: StationEvent }) {
  const words = text.value.health;
  const bad = /failed|interrupted|fault_enabled|station.stopped|door.waiting|delivery.dead/.test(event.kind);
  return (
    <tr>
      <td class="number muted">{event.seq}</td>
      <td class="nowrap">{dateTime(event.at_ms, language.value)}</td>
      <td>
        <span class={bad ? "tag bad" : undefined}>
          {bad && "✕ "}
          {words.event_kinds[event.kind] ?? event.kind}
        </span>
      </td>
      <td data-label={words.subject} class="about">
        {[eventDetail(event), eventActor(event)].filter(Boolean).join(" · ")}{" "}
        <span class="mono muted">{event.subject}</span>
      </td>
    </tr>
  );
}
