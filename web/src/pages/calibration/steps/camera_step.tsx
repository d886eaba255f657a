/** Boards before the camera: live corners, what is missing, images by themselves when the board is still. */

import { useEffect, useMemo, useRef } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { ProblemCard } from "../../../components/problem";
import { useHalted } from "../../../components/station/halted";
import { remembered } from "../../../state/browser/remembered";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { BoardImage } from "../session/board_image";
import { LiveBoard } from "../session/live_board";
import { LookFacts } from "../session/look_facts";
import { NeedsView } from "../session/needs_view";
import { OperatorPanel } from "../session/operator_panel";
import { PosesView } from "../session/poses_view";
import { type Corner, FEWEST_BOARDS, type Look, readableBoards, type Session } from "../session/session_state";
import { isKnownPlace, isThere, STILL_FOR_MS } from "../session/stillness";
import { goToStep, type StepProperties } from "./wizard";

/** Whether images are taken by themselves. */
const auto_capture = remembered("calibration.auto", true);

export function CameraStep({ session, change }: StepProperties) {
  const app = useApp();
  const { api, control, station } = app;
  const words = text.value.calibration;
  const current = useRef(session);
  // Poses whose image was deleted; they are not auto-captured again until the board has moved away.
  const let_go = useRef<(readonly Corner[])[]>([]);
  if (current.current !== session) {
    const kept = new Set(session.body.poses.map((pose) => pose.id));
    const gone = current.current.body.poses.filter((pose) => !kept.has(pose.id));
    let_go.current.push(...gone.map((pose) => pose.board.corners));
    current.current = session;
  }
  const id = session.id;
  const changes = useRef(change);
  changes.current = change;
  const take = useMemo(
    () =>
      new Command(async () => {
        board.paused = true;
        try {
          await control.ensure();
          await changes.current((if_match) => {
            const header = { "Sheaf-Control": control.id() ?? "", "If-Match": if_match };
            return data(api.POST("/api/v1/calibration-sessions/{id}/poses", { params: { path: { id }, header } }));
          });
          board.clear();
          // Taking the image has ended the live view.
          await board.start();
        } finally {
          board.paused = false;
        }
      }),
    [id],
  );
  const onLook = (look: Look, still_ms: number) => {
    const ready = look.corners.length > 0 && !look.problem && still_ms >= STILL_FOR_MS;
    const free = control.mine.peek() && !take.running;
    let_go.current = let_go.current.filter((corners) => isThere(look, corners));
    const wanted = let_go.current.length === 0 && !isKnownPlace(look, current.current);
    if (auto_capture.peek() && ready && free && wanted) void take.start();
  };
  const board = useMemo(() => new LiveBoard(app, session, onLook), [id]);
  useEffect(() => {
    board.begin();
    return () => board.dispose();
  }, [board]);
  const live = useMemo(() => new Command(() => board.start()), [board]);
  const end = useMemo(() => new Command(() => board.stop()), [board]);
  const look = board.look.value;
  const halted = useHalted();
  const blocked = halted ?? (station.busy.value && !take.running && words.busy);
  return (
    <div class="camera-step">
      <div class="stack main">
        <BoardImage board={board} />
        <div class="row live-acts">
          {board.runs || take.running ? (
            <>
              <CommandButton command={take} kind="primary" blocked={blocked}>
                {words.capture_pose}
              </CommandButton>
              <label class="check">
                <input
                  type="checkbox"
                  checked={auto_capture.value}
                  onChange={(event) => {
                    auto_capture.value = event.currentTarget.checked;
                  }}
                />
                {words.auto}
              </label>
              <span class="grow" />
              <CommandButton command={end}>{words.live_stop}</CommandButton>
            </>
          ) : (
            <>
              <CommandButton command={live} kind="primary" blocked={blocked}>
                {words.live_start}
              </CommandButton>
              <span class="muted">{words.live_starting_hint}</span>
            </>
          )}
        </div>
        {board.runs && <LookFacts board={board} session={session} taking={take.running} />}
        {board.problem.value && <ProblemCard problem={board.problem.value} />}
      </div>
      <div class="stack side">
        <OperatorPanel n_taken={session.body.poses.length} onMoved={() => board.clear()} />
        <NeedsView session={session} look={look} />
      </div>
      <PosesView session={session} change={change} />
      <Onward session={session} />
    </div>
  );
}

function Onward({ session }: { session: Session }) {
  const words = text.value.calibration;
  const n = readableBoards(session);
  const blocked = n < FEWEST_BOARDS && words.solve_blocked(String(n), String(FEWEST_BOARDS));
  return (
    <div class="command onward">
      <button
        type="button"
        class="primary"
        aria-disabled={blocked ? "true" : undefined}
        onClick={() => !blocked && goToStep(session.id, "light")}
      >
        {words.next(words.step_names.light ?? "")}
      </button>
      {blocked && <small class="why">{blocked}</small>}
    </div>
  );
}
