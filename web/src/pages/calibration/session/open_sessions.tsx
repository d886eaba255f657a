/** Unfinished sessions, which can be continued from any browser. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Dialog } from "../../../components/dialogs/dialog";
import { href } from "../../../state/browser/route";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { readableBoards, type Session } from "./session_state";

export function OpenSessions(properties: { sessions: readonly Session[]; reload: () => Promise<void> }) {
  const words = text.value.calibration;
  const asked = useSignal<Session | undefined>(undefined);
  return (
    <section class="card">
      <h2>{words.sessions}</h2>
      <ul class="plain listed">
        {properties.sessions.map((session) => (
          <li key={session.id} class="row" data-session={session.id}>
            <span class="grow">
              <strong>{session.body.name}</strong>{" "}
              <span class="muted">
                {words.session_state(String(readableBoards(session)), String(session.body.stage_views.length))},{" "}
                {words.changed} {dateTime(session.changed_at_ms, language.value)}
              </span>
            </span>
            <a class="button" href={href("calibration", session.id)}>
              {words.continue}
            </a>
            <button
              type="button"
              onClick={() => {
                asked.value = session;
              }}
            >
              {words.discard}
            </button>
          </li>
        ))}
      </ul>
      {asked.value && (
        <Discard session={asked.value} onDone={properties.reload} onClose={() => (asked.value = undefined)} />
      )}
    </section>
  );
}

export function Discard(properties: { session: Session; onDone: () => Promise<void>; onClose: () => void }) {
  const { session, onDone, onClose } = properties;
  const { api } = useApp();
  const words = text.value.calibration;
  const discard = useMemo(
    () =>
      new Command(async () => {
        const params = { path: { id: session.id } };
        await data(api.DELETE("/api/v1/calibration-sessions/{id}", { params }));
        onClose();
        await onDone();
      }),
    [api, session.id],
  );
  return (
    <Dialog title={words.discard_yes} onClose={onClose}>
      <p>{words.discard_question(session.body.name)}</p>
      <div class="row">
        <CommandButton command={discard} kind="danger">
          {words.discard_yes}
        </CommandButton>
        <button type="button" onClick={onClose}>
          {text.value.common.cancel}
        </button>
      </div>
    </Dialog>
  );
}
