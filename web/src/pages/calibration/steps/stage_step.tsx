/** Captures the board on the stage at several positions, and computes the calibration. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { useForm } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { Show } from "../../../components/loading/loading";
import { useHalted } from "../../../components/station/halted";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { decimal } from "../../../units";
import { AxisView } from "../details/axis_view";
import { useCalibration } from "../details/details";
import { StageView } from "../details/stage_view";
import { ExposuresCard } from "../exposures/exposures_card";
import { placeBoard, StageOperatorPanel } from "../session/operator_panel";
import type { Change } from "../session/session_change";
import { SessionImage } from "../session/session_image";
import type { Session } from "../session/session_state";
import { Solve } from "./solve";
import type { StepProperties } from "./wizard";

/** Positions captured automatically, mm from the middle of the travel; five also show the straightness. */
const POSITIONS_MM = [-20, -10, 0, 10, 20];

/** Angles captured automatically on a turntable; at larger ones the board is not detected reliably. */
const ANGLES_DEG = [-30, -20, -10, 0, 10, 20, 30];

export function StageStep(properties: StepProperties) {
  const { session, calibration_id, change } = properties;
  const { station } = useApp();
  const words = text.value.calibration;
  return (
    <div class="stack">
      <p>{station.rotary.value ? words.turntable_lead : words.stage_lead}</p>
      <div class="cards two">
        <CaptureViews session={session} change={change} />
        <StageOperatorPanel />
      </div>
      <ExposuresCard session={session} change={change} hint={words.exposures_next} />
      <ViewsList session={session} change={change} />
      <Solve {...properties} />
      {calibration_id && <StageResult id={calibration_id} />}
    </div>
  );
}

function StageResult({ id }: { id: string }) {
  const { state } = useCalibration(id);
  return (
    <Show of={state}>
      {(calibration) => {
        const { stage, axis } = calibration.summary;
        return stage || axis ? (
          <section class="card">
            {stage && <StageView stage={stage} />}
            {axis && <AxisView axis={axis} />}
          </section>
        ) : null;
      }}
    </Show>
  );
}

interface Properties {
  session: Session;
  change: Change;
}

function CaptureViews({ session, change }: Properties) {
  const app = useApp();
  const { api, control, station } = app;
  const words = text.value.calibration;
  const typed = useSignal<number | undefined>(0);
  const rotary = station.rotary.value;
  const places = rotary ? ANGLES_DEG : POSITIONS_MM;
  const form = useForm();
  const captureAt = async (at: number) => {
    const body = station.rotary.peek() ? { angle_deg: at } : { position_mm: at };
    await control.ensure();
    return await change((if_match) => {
      const header = { "Sheaf-Control": control.id() ?? "", "If-Match": if_match };
      const params = { path: { id: session.id }, header };
      return data(api.POST("/api/v1/calibration-sessions/{id}/stage-views", { params, body }));
    });
  };
  const one = useMemo(
    () =>
      new Command(async () => {
        await captureAt(typed.peek() ?? 0);
      }),
    [session.id, change],
  );
  const all = useMemo(
    () =>
      new Command(async (steps) => {
        if (station.simulated.peek() === "twin") await placeBoard(app, { place: "stage" });
        for (const at of station.rotary.peek() ? ANGLES_DEG : POSITIONS_MM) {
          if (!(await captureAt(at))) break;
          steps.accepted();
        }
        if (station.simulated.peek() === "twin") await placeBoard(app, { place: "away" });
      }),
    [session.id, change],
  );
  const travel = station.travel.value;
  const halted = useHalted();
  const busy = halted ?? (station.busy.value && !one.running && !all.running && words.busy);
  return (
    <section class="card stack">
      <h2>{words.stage_positions}</h2>
      <p class="muted">{words.moves}</p>
      <div>
        <CommandButton command={all} kind="primary" blocked={busy || (one.running && words.capturing)}>
          {words.capture_views(places.length)}
        </CommandButton>
      </div>
      <div class="row end">
        <NumberField
          form={form}
          label={words.view_at}
          unit={station.unit.value}
          value={typed.value}
          min={travel?.[0]}
          max={travel?.[1]}
          onChange={(value) => {
            typed.value = value;
          }}
        />
        <CommandButton command={one} blocked={form.blocked.value ?? (busy || (all.running && words.capturing))}>
          {words.capture_view}
        </CommandButton>
      </div>
    </section>
  );
}

function ViewsList({ session, change }: Properties) {
  const words = text.value.calibration;
  const views = session.body.stage_views;
  return (
    <section class="card stack">
      <h2>
        {words.images} <span class="muted number">({views.length})</span>
      </h2>
      <p class="muted">{views.length === 0 ? words.views_none : words.view_few}</p>
      <ul class="pose-list">
        {views.map((view) => (
          <View key={view.id} view={view} session={session} change={change} />
        ))}
      </ul>
    </section>
  );
}

function View({ view, session, change }: Properties & { view: Schemas["SessionStageViewDto"] }) {
  const { api } = useApp();
  const words = text.value.calibration;
  const at =
    view.angle_deg != null
      ? `${decimal(view.angle_deg, 2, language.value)}°`
      : `${decimal(view.position_mm, 3, language.value)} mm`;
  const remove = useMemo(
    () =>
      new Command(async () => {
        await change((if_match) => {
          const params = { path: { id: session.id, view_id: view.id }, header: { "If-Match": if_match } };
          return data(api.DELETE("/api/v1/calibration-sessions/{id}/stage-views/{view_id}", { params }));
        });
      }),
    [api, session.id, view.id, change],
  );
  return (
    <li class="pose" data-view={view.id}>
      <SessionImage
        session={session}
        artifact={view.board.image.artifact}
        label={at}
        dots={view.board.corners.map(([, , u = 0, v = 0]) => [u, v, undefined] as const)}
      />
      <strong class="number">{at}</strong>
      {view.board.problem && <small class="bad">⚠ {view.board.problem}</small>}
      <CommandButton command={remove}>{words.delete_view}</CommandButton>
    </li>
  );
}
