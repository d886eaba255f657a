/** Before the first image: state of the station, board, line projector and exposures. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, idempotencyKey } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { useForm } from "../../../components/fields/form";
import { TextField } from "../../../components/fields/text_field";
import { Show, useLoaded } from "../../../components/loading/loading";
import { DarkFrameCard } from "../../../components/station/dark_frame_card";
import { goTo, href } from "../../../state/browser/route";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { ExposureFacts, ExposureFields } from "../exposures/exposure_fields";
import { type Draft, draftFrom, requestOf } from "../session/new_session";
import { ProjectorFacts, ProjectorFields } from "../session/projector_form";
import { TargetFacts, TargetFields } from "../session/target_form";
import { goToStep, type StepProperties } from "./wizard";

/** The state of each device. */
export function StationFacts() {
  const { station } = useApp();
  const words = text.value.calibration;
  const { devices } = text.value.health;
  const status = station.status.value;
  if (!status) return null;
  const { camera, stage, laser } = status;
  const interlock_open = laser.interlock_closed === false;
  const lines = [
    [devices.camera, camera.connected ? undefined : words.check_missing],
    [devices.stage, !stage.connected ? words.check_missing : stage.homed ? undefined : words.check_not_homed],
    [devices.laser, !laser.connected ? words.check_missing : interlock_open ? words.check_interlock : undefined],
  ] as const;
  return (
    <dl class="facts live-data">
      {lines.map(([name, wrong]) => [
        <dt key={name}>{name}</dt>,
        <dd key={`${name}-state`}>{wrong ? <span class="tag bad">⚠ {wrong}</span> : words.check_ok}</dd>,
      ])}
    </dl>
  );
}

/** The step in an existing session: its settings, read-only. */
export function StationCheck({ session }: StepProperties) {
  const words = text.value.calibration;
  const { target, projector, exposures } = session.body;
  return (
    <div class="stack">
      <div class="cards two">
        <section class="card">
          <h2>{text.value.frame.station}</h2>
          <StationFacts />
        </section>
        <section class="card">
          <h2>{words.board}</h2>
          <TargetFacts target={target} />
        </section>
        <section class="card">
          <h2>{words.projector}</h2>
          <ProjectorFacts projector={projector} />
        </section>
        <section class="card">
          <h2>{words.exposures}</h2>
          <ExposureFacts exposures={exposures} />
        </section>
        <DarkFrameCard />
      </div>
      <div>
        <button type="button" class="primary" onClick={() => goToStep(session.id, "camera")}>
          {words.next(words.step_names.camera ?? "")}
        </button>
      </div>
    </div>
  );
}

/** The form that starts a new session. */
export function NewSession() {
  const { api } = useApp();
  const words = text.value.calibration;
  const { state } = useLoaded(
    async () => draftFrom(await data(api.GET("/api/v1/calibration-sessions/defaults"))),
    [api],
  );
  return (
    <div class="calibration stack">
      <header class="row wizard-header">
        <h1 class="grow">{words.step_by_step}</h1>
        <a class="button" href={href("calibration")}>
          {text.value.common.cancel}
        </a>
      </header>
      <p>
        {words.check_lead} {words.active_untouched}
      </p>
      <div class="cards two">
        <section class="card">
          <h2>{text.value.frame.station}</h2>
          <StationFacts />
        </section>
        <DarkFrameCard />
      </div>
      <Show of={state}>{(defaults) => <NewSessionForm defaults={defaults} />}</Show>
    </div>
  );
}

function NewSessionForm({ defaults }: { defaults: Draft }) {
  const { api } = useApp();
  const words = text.value.calibration;
  const today = new Date().toLocaleDateString(language.value);
  const name = useSignal(words.name_initial(today));
  const draft = useSignal<Draft>(defaults);
  const orders_wrong = useSignal(false);
  const form = useForm();
  const change = (part: Partial<Draft>) => {
    draft.value = { ...draft.value, ...part };
  };
  const begin = useMemo(
    () =>
      new Command(async () => {
        const session = await data(
          api.POST("/api/v1/calibration-sessions", {
            headers: { "Idempotency-Key": idempotencyKey() },
            body: requestOf(name.value, draft.value),
          }),
        );
        goTo("calibration", session.id);
      }),
    [api],
  );
  const { target, projector, exposures } = draft.value;
  return (
    <form class="stack" onSubmit={(event) => event.preventDefault()}>
      <p class="muted">{words.defaults_of_station}</p>
      <div class="cards two">
        <section class="card stack">
          <h2>{words.board}</h2>
          <TargetFields form={form} target={target} onChange={(target) => change({ target })} />
        </section>
        <section class="card stack">
          <h2>{words.projector}</h2>
          <p class="muted">{words.projector_hint}</p>
          <ProjectorFields
            form={form}
            projector={projector}
            onChange={(projector) => change({ projector })}
            onOrders={(right) => {
              orders_wrong.value = !right;
            }}
          />
        </section>
        <section class="card stack">
          <h2>{words.exposures}</h2>
          <p class="muted">{words.exposures_hint}</p>
          <ExposureFields
            form={form}
            exposures={exposures}
            onChange={(changed) => change({ exposures: { ...draft.peek().exposures, ...changed } })}
          />
        </section>
      </div>
      <TextField
        class="session-name"
        label={words.name}
        value={name.value}
        maxLength={100}
        onChange={(typed) => (name.value = typed)}
      />
      <div>
        <CommandButton
          command={begin}
          kind="primary"
          blocked={form.blocked.value ?? (orders_wrong.value && words.orders_wrong)}
        >
          {words.create_session}
        </CommandButton>
      </div>
    </form>
  );
}
