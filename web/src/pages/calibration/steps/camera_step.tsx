/** Captures images of the board: live detection, requirements, auto-capture when the board is still. */

import { useEffect, useMemo, useRef } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Check } from "../../../components/fields/check";
import { ProblemCard } from "../../../components/problem";
import { useHalted } from "../../../components/station/halted";
import { remembered } from "../../../state/browser/remembered";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { ExposuresCard } from "../exposures/exposures_card";
import { BoardImage } from "../session/board_image";
import { DetectionFacts } from "../session/detection_facts";
import { LiveBoard } from "../session/live_board";
import { OperatorPanel } from "../session/operator_panel";
import { PosesView } from "../session/poses_view";
import { RequirementsView } from "../session/requirements_view";
import type { Change } from "../session/session_change";
import {
  type Corner,
  type Detection,
  FEWEST_BOARDS,
  readableBoards,
  type Session,
} from "../session/session_state";
import { isAtPose, isKnownPose, STILL_FOR_MS } from "../session/stillness";
import { goToStep, type StepProperties } from "./wizard";

/** Whether auto-capture is on. */
const auto_capture = remembered("calibration.auto", true);

export function CameraStep({ session, change }: StepProperties) {
  const app = useApp();
  const { api, control, station } = app;
  const words = text.value.calibration;
  const current = useRef(session);
  // Poses whose image was deleted; they are not auto-captured again until the board has moved away.
  const deleted_poses = useRef<(readonly Corner[])[]>([]);
  if (current.current !== session) {
    const kept = new Set(session.body.poses.map((pose) => pose.id));
    const deleted = current.current.body.poses.filter((pose) => !kept.has(pose.id));
    deleted_poses.current.push(...deleted.map((pose) => pose.board.corners));
    current.current = session;
  }
  const id = session.id;
  const capture = useMemo(
    () =>
      new Command(async () => {
        board.paused = true;
        try {
          await control.ensure();
          await change((if_match) => {
            const header = { "Sheaf-Control": control.id() ?? "", "If-Match": if_match };
            return data(api.POST("/api/v1/calibration-sessions/{id}/poses", { params: { path: { id }, header } }));
          });
          board.clear();
          // Capturing the image has ended the live view.
          await board.start();
        } finally {
          board.paused = false;
        }
      }),
    [id, change],
  );
  const onDetection = (detection: Detection, still_ms: number) => {
    const ready = detection.corners.length > 0 && !detection.problem && still_ms >= STILL_FOR_MS;
    const free = control.mine.peek() && !capture.running;
    deleted_poses.current = deleted_poses.current.filter((corners) => isAtPose(detection, corners));
    const wanted = deleted_poses.current.length === 0 && !isKnownPose(detection, current.current);
    if (auto_capture.peek() && ready && free && wanted) void capture.start();
  };
  const board = useMemo(() => new LiveBoard(app, session, onDetection), [id]);
  useEffect(() => {
    board.startDetection();
    return () => board.dispose();
  }, [board]);
  const { runs } = board;
  useEffect(() => void board.follow(session), [board, session, runs]);
  const changeExposures = useMemo<Change>(
    () => async (act) => {
      await board.takeIfFree();
      return await change(act);
    },
    [board, change],
  );
  const live = useMemo(() => new Command(() => board.start()), [board]);
  const end = useMemo(() => new Command(() => board.stop()), [board]);
  const detection = board.detection.value;
  const halted = useHalted();
  const blocked = halted ?? (station.busy.value && !capture.running && words.busy);
  return (
    <div class="camera-step">
      <div class="stack main">
        <BoardImage board={board} />
        <div class="row live-acts">
          {runs || capture.running ? (
            <>
              <CommandButton command={capture} kind="primary" blocked={blocked}>
                {words.capture_pose}
              </CommandButton>
              <Check
                label={words.auto}
                checked={auto_capture.value}
                onChange={(checked) => {
                  auto_capture.value = checked;
                }}
              />
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
        {runs && <DetectionFacts board={board} session={session} capturing={capture.running} />}
        {board.problem.value && <ProblemCard problem={board.problem.value} />}
        {board.exposure_problem.value && <ProblemCard problem={board.exposure_problem.value} />}
      </div>
      <div class="stack side">
        <OperatorPanel n_captured={session.body.poses.length} onMoved={() => board.clear()} />
        <ExposuresCard session={session} change={changeExposures} hint={words.exposures_live} />
        <RequirementsView session={session} detection={detection} />
      </div>
      <PosesView session={session} change={change} />
      <NextStep session={session} />
    </div>
  );
}

function NextStep({ session }: { session: Session }) {
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
