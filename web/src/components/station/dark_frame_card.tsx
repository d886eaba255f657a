/** The camera's dark frame: takes it, shows how it corrects the frames, removes it. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, ProblemError, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { Command } from "../../state/station/command";
import { language, text } from "../../text";
import { count, dateTime, decimal } from "../../units";
import { CommandButton } from "../command_button";
import { Dialog } from "../dialogs/dialog";
import { useAutoReloaded } from "../loading/auto_reloaded";
import { Show } from "../loading/loading";
import { useBlocked } from "./blocked";

type DarkFrame = Schemas["DarkFrameDto"];

export function DarkFrameCard() {
  const { api, station } = useApp();
  const words = text.value.dark_frame;
  const camera = station.status.value?.camera;
  // Whether it corrects the frames depends on the camera's settings.
  const settings = camera && JSON.stringify(camera.settings);
  const { state } = useAutoReloaded(
    async () => {
      try {
        return { dark_frame: await data(api.GET("/api/v1/devices/camera/dark-frame")) };
      } catch (cause) {
        if (cause instanceof ProblemError && cause.problem.status === 404) return { dark_frame: undefined };
        throw cause;
      }
    },
    (event) => event.kind.startsWith("camera.dark_frame_"),
    [settings],
  );
  return (
    <section class="card stack" data-dark-frame>
      <h2>{words.title}</h2>
      <Show of={state}>
        {({ dark_frame }) => (
          <>
            {dark_frame ? <Facts of={dark_frame} /> : <p class="muted">{words.none}</p>}
            <Commands taken={dark_frame !== undefined} />
          </>
        )}
      </Show>
    </section>
  );
}

function Facts({ of }: { of: DarkFrame }) {
  const words = text.value.dark_frame;
  const chosen = language.value;
  const level = (value: number) => decimal(value, 1, chosen);
  return (
    <>
      <p data-used={of.used}>{words.used[of.used]}</p>
      <dl class="facts">
        <dt>{words.taken}</dt>
        <dd>{dateTime(of.taken_at_ms, chosen)}</dd>
        <dt>{words.exposure}</dt>
        <dd class="number">
          {decimal(of.exposure_us, 0, chosen)} µs · {decimal(of.gain_db, 1, chosen)} dB
        </dd>
        <dt>{words.hot_pixels}</dt>
        <dd class="number">{count(of.n_hot_pixels, chosen)}</dd>
        <dt>{words.noise}</dt>
        <dd class="number">{words.levels(level(of.noise), 2 ** of.bit_depth - 1)}</dd>
        <dt>{words.pattern}</dt>
        <dd class="number">{words.levels(level(of.pattern), 2 ** of.bit_depth - 1)}</dd>
      </dl>
    </>
  );
}

function Commands({ taken }: { taken: boolean }) {
  const { api, control } = useApp();
  const words = text.value.dark_frame;
  const blocked = useBlocked();
  const asking = useSignal(false);
  const lease = async () => {
    await control.ensure();
    return { header: { "Sheaf-Control": control.id() ?? "" } };
  };
  const take = useMemo(
    () =>
      new Command(async () => {
        await data(
          api.POST("/api/v1/devices/camera/dark-frame", { params: await lease(), body: { n_frames: null } }),
        );
        asking.value = false;
      }),
    [api, control],
  );
  const remove = useMemo(
    () =>
      new Command(async () => {
        await data(api.DELETE("/api/v1/devices/camera/dark-frame", { params: await lease() }));
      }),
    [api, control],
  );
  return (
    <div class="row">
      <button
        type="button"
        aria-disabled={blocked ? "true" : undefined}
        title={blocked}
        onClick={() => {
          if (!blocked) asking.value = true;
        }}
      >
        {taken ? words.retake : words.take}
      </button>
      {taken && (
        <CommandButton command={remove} blocked={blocked}>
          {words.remove}
        </CommandButton>
      )}
      {asking.value && (
        <Dialog title={words.take} onClose={() => (asking.value = false)}>
          <p>{words.cover_lens}</p>
          <div class="row">
            <CommandButton command={take} kind="primary" blocked={blocked}>
              {words.covered}
            </CommandButton>
            <button type="button" onClick={() => (asking.value = false)}>
              {text.value.common.cancel}
            </button>
          </div>
        </Dialog>
      )}
    </div>
  );
}
