/** The virtual operator of the simulated station, which holds the board. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../../api/client";
import { type App, useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Choice } from "../../../components/fields/choice";
import { ProblemCard } from "../../../components/problem";
import { Command } from "../../../state/station/command";
import { positionOf } from "../../../state/station/station";
import { text } from "../../../text";

/** Number of poses of the virtual operator; enough for any calibration. */
const N_POSES = 12;

/** Longest wait for the stage to stop before the board is held over it, ms. */
const STAGE_REST_MS = 20_000;

export function OperatorPanel({ n_captured, onMoved }: { n_captured: number; onMoved: () => void }) {
  const app = useApp();
  const words = text.value.calibration;
  // The next pose without an image, counted from 1.
  const pose = useSignal(Math.min(N_POSES, n_captured + 1));
  const held = useSignal<number | undefined>(undefined);
  const hold = useMemo(
    () =>
      new Command<[number]>(async (_, number) => {
        pose.value = number;
        await moveStageToZero(app);
        await placeBoard(app, { place: "pose", pose: number - 1 });
        held.value = number;
        onMoved();
      }),
    [app],
  );
  if (app.station.simulated.value !== "twin") return null;
  return (
    <section class="card stack operator-panel">
      <h2>{words.virtual_operator}</h2>
      <p class="muted">{held.value ? words.held_pose(held.value) : words.operator_hint}</p>
      <div class="row end">
        <Choice
          label={words.hold_pose}
          value={pose.value}
          options={Array.from({ length: N_POSES }, (_, idx) => [idx + 1, String(idx + 1)])}
          onChange={(number) => (pose.value = number)}
        />
        <button type="button" onClick={() => void hold.start(pose.value)}>
          {words.hold}
        </button>
        <button
          type="button"
          class="next-pose"
          onClick={() => void hold.start(held.value === undefined ? pose.value : (held.value % N_POSES) + 1)}
        >
          {words.next_pose}
        </button>
      </div>
      <CommandProblem command={hold} />
    </section>
  );
}

/** The virtual operator in the step “Stage”: places the board on the stage. */
export function StageOperatorPanel() {
  const app = useApp();
  const words = text.value.calibration;
  const place_on_stage = useMemo(() => new Command(() => placeBoard(app, { place: "stage" })), [app]);
  const remove = useMemo(() => new Command(() => placeBoard(app, { place: "away" })), [app]);
  if (app.station.simulated.value !== "twin") return null;
  const state =
    place_on_stage.phase.value === "done"
      ? words.board_on_stage
      : remove.phase.value === "done"
        ? words.board_away
        : undefined;
  return (
    <section class="card stack operator-panel">
      <h2>{words.virtual_operator}</h2>
      <p class="muted">{state ?? words.operator_hint}</p>
      <div class="row">
        <CommandButton command={place_on_stage}>{words.place_on_stage}</CommandButton>
        <CommandButton command={remove}>{words.remove_board}</CommandButton>
      </div>
    </section>
  );
}

/** Tells the virtual operator where to hold the board. */
export async function placeBoard({ api }: App, board: Schemas["VirtualBoardDto"]): Promise<void> {
  await data(api.PUT("/api/v1/simulation/board", { body: board }));
}

/** Moves the stage to 0, for which the poses of the simulated station are defined. */
async function moveStageToZero({ api, control, station }: App): Promise<void> {
  if (station.position.peek() === 0) return;
  await control.ensure();
  const params = { header: { "Sheaf-Control": control.id() ?? "" } };
  await data(
    api.POST("/api/v1/devices/stage/move", {
      params,
      body: station.rotary.peek() ? { target_deg: 0 } : { target_mm: 0 },
    }),
  );
  const begun = performance.now();
  while (performance.now() - begun < STAGE_REST_MS) {
    const stage = await data(api.GET("/api/v1/devices/stage"));
    if (!stage.moving && positionOf(stage) === 0) return;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

function CommandProblem({ command }: { command: Command<[number]> }) {
  const problem = command.problem.value;
  return problem ? <ProblemCard problem={problem} onDismiss={() => command.dismiss()} /> : null;
}
