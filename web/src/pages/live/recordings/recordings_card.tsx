/** Starts and stops recordings, and lists them. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { data, idempotencyKey } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Dialog } from "../../../components/dialogs/dialog";
import { ProblemCard } from "../../../components/problem";
import { useBlocked } from "../../../components/station/blocked";
import { Resource } from "../../../state/resource";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { bytes, count, dateTime, duration } from "../../../units";
import { lossesOf, nothingFreed, type Recording } from "./recording_facts";

/** Number of recordings listed; the API has all of them. */
const SHOWN = 8;

/** Update interval of a running recording, ms. */
const REFRESH_EVERY_MS = 1000;

export function RecordingsCard() {
  const { api, events } = useApp();
  const words = text.value.live.recordings;
  const list = useMemo(() => new Resource<readonly Recording[]>(), []);
  const asked = useSignal<Recording | undefined>(undefined);
  const load = useMemo(
    () => () =>
      list.load(async () => {
        const params = { query: { limit: SHOWN } };
        return (await data(api.GET("/api/v1/recordings", { params }))).items;
      }),
    [api, list],
  );
  useEffect(() => {
    void load();
    return events.follow((new_events) => {
      if (new_events.length === 0 || new_events.some((event) => event.kind.startsWith("recording."))) void load();
    });
  }, [events, load]);
  const { value: recordings, problem } = list.state.value;
  const running = recordings?.find((recording) => recording.state === "recording");
  useEffect(() => {
    if (!running) return;
    const timer = setInterval(() => void load(), REFRESH_EVERY_MS);
    return () => clearInterval(timer);
  }, [running?.id, load]);
  const others = recordings?.filter((recording) => recording !== running) ?? [];
  return (
    <section class="card stack" data-recordings>
      <h2>{words.title}</h2>
      {running ? <Running recording={running} reload={load} /> : <Record reload={load} />}
      {problem && <ProblemCard problem={problem} />}
      {recordings && others.length === 0 && !running && <p class="muted">{words.none}</p>}
      <ul class="plain listed">
        {others.map((recording) => (
          <Row key={recording.id} recording={recording} onDelete={() => (asked.value = recording)} />
        ))}
      </ul>
      {asked.value && <Delete recording={asked.value} reload={load} onClose={() => (asked.value = undefined)} />}
    </section>
  );
}

/** The button that starts a recording of the live view. */
function Record({ reload }: { reload: () => Promise<void> }) {
  const { api, control, station } = useApp();
  const words = text.value.live.recordings;
  const blocked = useBlocked();
  const live = station.status.value?.state === "Operational.ContinuousExecution";
  const begin = useMemo(
    () =>
      new Command(async () => {
        await control.ensure();
        const header = { "Sheaf-Control": control.id() ?? "", "Idempotency-Key": idempotencyKey() };
        await data(api.POST("/api/v1/recordings", { params: { header }, body: {} }));
        await reload();
      }),
    [api, control, reload],
  );
  return (
    <CommandButton command={begin} blocked={blocked ?? (live ? undefined : words.needs_live)}>
      {words.record}
    </CommandButton>
  );
}

/** The running recording, and the button that stops it. */
function Running({ recording, reload }: { recording: Recording; reload: () => Promise<void> }) {
  const { api, control } = useApp();
  const words = text.value.live.recordings;
  const end = useMemo(
    () =>
      new Command(async () => {
        await control.ensure();
        const params = { path: { id: recording.id }, header: { "Sheaf-Control": control.id() ?? "" } };
        await data(api.POST("/api/v1/recordings/{id}/stop", { params }));
        await reload();
      }),
    [api, control, reload, recording.id],
  );
  const lost = lossesOf(recording);
  return (
    <div class="stack" data-recording={recording.id}>
      <p>
        <strong>{words.running(recording.name)}</strong>
      </p>
      <p class="muted">
        {words.frames(count(recording.n_frames, language.value))} ·{" "}
        {duration(recording.duration_s, language.value)} · {bytes(recording.size_bytes, language.value)}
      </p>
      {lost > 0 && <p class="note">{words.lost(count(lost, language.value))}</p>}
      <CommandButton command={end}>{words.stop}</CommandButton>
    </div>
  );
}

function Row({ recording, onDelete }: { recording: Recording; onDelete: () => void }) {
  const words = text.value.live.recordings;
  const lost = lossesOf(recording);
  const facts = [
    words.frames(count(recording.n_frames, language.value)),
    duration(recording.duration_s, language.value),
    bytes(recording.size_bytes, language.value),
  ];
  return (
    <li class="stack" data-recording={recording.id}>
      <span>
        <strong>{recording.name}</strong>{" "}
        <span class="muted">{dateTime(recording.started_at_ms, language.value)}</span>
      </span>
      <span class="muted">{facts.join(" · ")}</span>
      {recording.state !== "complete" && <span>{words.states[recording.state]}</span>}
      {recording.ended && words.ended_early[recording.ended] && <span>{words.ended_early[recording.ended]}</span>}
      {lost > 0 && <span>{words.lost(count(lost, language.value))}</span>}
      <span class="row">
        {recording.file && (
          <a class="button" href={recording.file} download={`${recording.name}.mcap`}>
            {words.download}
          </a>
        )}
        <button type="button" onClick={onDelete} disabled={recording.state === "finishing"}>
          {words.delete}
        </button>
      </span>
    </li>
  );
}

function Delete(properties: { recording: Recording; reload: () => Promise<void>; onClose: () => void }) {
  const { recording, reload, onClose } = properties;
  const { api } = useApp();
  const words = text.value.live.recordings;
  const command = useMemo(
    () =>
      new Command(async () => {
        const params = { path: { id: recording.id } };
        await data(api.DELETE("/api/v1/recordings/{id}", { params }));
        onClose();
        await reload();
      }),
    [api, recording.id],
  );
  const freed = bytes(recording.size_bytes, language.value);
  return (
    <Dialog title={words.delete_yes} onClose={onClose}>
      <p>
        {nothingFreed(recording)
          ? words.delete_question(recording.name)
          : words.delete_frees(recording.name, freed)}
      </p>
      <div class="row">
        <CommandButton command={command} kind="danger">
          {words.delete_yes}
        </CommandButton>
        <button type="button" onClick={onClose}>
          {text.value.common.cancel}
        </button>
      </div>
    </Dialog>
  );
}
