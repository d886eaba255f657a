/** One door: state, counts, last failure, commands, attempts and deliveries set aside. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { relativeTime, useNow } from "../../../components/relative_time";
import type { Door } from "../../../state/records/doors";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { Attempts } from "./attempts";
import { Deliveries } from "./deliveries";
import { kindName, number, STATE_TAGS, setAside } from "./door_facts";

interface Properties {
  door: Door;
  reload: () => Promise<void>;
}

export function DoorCard({ door, reload }: Properties) {
  const { style, symbol } = STATE_TAGS[door.state];
  return (
    <li class="door stack" data-door={door.name} data-door-state={door.state}>
      <div class="row live-data">
        <h3>{door.name}</h3>
        <span>{kindName(door.kind)}</span>
        <span class="mono grow target">{door.target}</span>
        <span class={style}>
          <span aria-hidden="true">{symbol}</span>
          {text.value.doors.states[door.state]}
        </span>
      </div>
      <Figures door={door} />
      <Failure door={door} />
      <Commands door={door} reload={reload} />
      <Attempts attempts={door.attempts} />
      {setAside(door) > 0 && <Deliveries door={door} reload={reload} />}
    </li>
  );
}

function Figures({ door }: { door: Door }) {
  const words = text.value.doors;
  const figures = [
    [words.delivered, words.n_events(number(door.n_delivered))],
    [words.last_delivery, <LastDelivery key="last" door={door} />],
    [words.behind, words.n_events(number(door.n_behind))],
    [words.set_aside, number(door.n_waiting)],
    [words.dead, door.n_dead > 0 ? <strong key="dead">! {number(door.n_dead)}</strong> : number(0)],
  ] as const;
  return (
    <dl class="figures live-data">
      {figures.map(([name, value]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd>{value}</dd>
        </div>
      ))}
    </dl>
  );
}

function LastDelivery({ door }: { door: Door }) {
  const words = text.value.doors;
  const now_ms = useNow();
  const { delivered_seq: seq, delivered_at_ms: at_ms } = door;
  if (seq == null || at_ms == null) return <>{words.never}</>;
  // The clock of the server may be ahead of that of the browser.
  const when = relativeTime(Math.min(at_ms, now_ms), now_ms, language.value);
  return <span title={dateTime(at_ms, language.value)}>{words.event_at(String(seq), when)}</span>;
}

/** Why the last attempt failed, and the time of the next one. */
function Failure({ door }: { door: Door }) {
  const words = text.value.doors;
  const now_ms = useNow();
  if (door.reason == null) return null;
  const next_ms = door.next_at_ms;
  return (
    <div class={door.state === "closed" ? "problem" : "note"}>
      {words.last_failure}: <span lang="en">{door.reason}</span>
      {next_ms != null && (
        <div class="number" title={dateTime(next_ms, language.value)}>
          {words.next_attempt(relativeTime(Math.max(next_ms, now_ms), now_ms, language.value))}
        </div>
      )}
      {door.state === "closed" && <div>{words.closed_hint}</div>}
    </div>
  );
}

function Commands({ door, reload }: Properties) {
  const { api } = useApp();
  const words = text.value.doors;
  const delivered_at_ms = useSignal<number | undefined>(undefined);
  // To the other doors a test message is sent.
  const checked = words.checked[door.kind];
  const params = { path: { name: door.name } };
  const test = useMemo(
    () =>
      new Command(async () => {
        delivered_at_ms.value = undefined;
        // Failed attempts are logged, too.
        await data(api.POST("/api/v1/doors/{name}/test", { params })).finally(() => reload());
        delivered_at_ms.value = Date.now();
      }),
    [api, door.name],
  );
  const resend = useMemo(
    () =>
      new Command(async () => {
        await data(api.POST("/api/v1/doors/{name}/resend-dead", { params }));
        await reload();
      }),
    [api, door.name],
  );
  return (
    <div class="row commands">
      <CommandButton command={test}>{checked ? words.check : words.send_test}</CommandButton>
      {(door.n_dead > 0 || resend.problem.value) && (
        <CommandButton command={resend}>{words.resend_dead(number(door.n_dead))}</CommandButton>
      )}
      {door.register_map_href != null && (
        <a class="button" download href={door.register_map_href}>
          {words.registers}
        </a>
      )}
      <span role="status">
        {delivered_at_ms.value !== undefined &&
          `✓ ${(checked ?? words.test_delivered)(dateTime(delivered_at_ms.value, language.value))}`}
      </span>
    </div>
  );
}
