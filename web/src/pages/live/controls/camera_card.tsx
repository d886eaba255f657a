/** Exposure, gain and frame rate, with the histogram and an advice on the exposure. */

import type { RefObject } from "preact";
import { useEffect, useMemo } from "preact/hooks";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { useForm } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { ProblemCard } from "../../../components/problem";
import { useBlocked } from "../../../components/station/blocked";
import { language, text } from "../../../text";
import { count, decimal } from "../../../units";
import type { LiveView } from "../live_view";
import { CameraSettings } from "./camera_settings";

interface Properties {
  view: LiveView | undefined;
  histogram: RefObject<HTMLCanvasElement | null>;
}

export function CameraCard({ view, histogram }: Properties) {
  const words = text.value.live;
  return (
    <section class="card stack">
      <h2>{words.exposure}</h2>
      <figure class="histogram live-data">
        <canvas ref={histogram} class="data-view" role="img" aria-label={words.histogram} />
        <figcaption class="row number">
          <small>0</small>
          <small class="grow">{words.grey_level}</small>
          <small>255</small>
        </figcaption>
      </figure>
      <AdviceLine view={view} />
      <Settings view={view} />
    </section>
  );
}

function AdviceLine({ view }: { view: LiveView | undefined }) {
  const words = text.value.live;
  const values = view?.values.value;
  const chosen = language.value;
  if (!values?.advice) return <p class="advice muted">{words.no_frame}</p>;
  const { kind, saturated, bright } = values.advice;
  const percent = (share: number) => `${decimal(100 * share, share < 0.01 ? 2 : share < 0.1 ? 1 : 0, chosen)} %`;
  if (kind === "over") {
    return (
      <p class="advice" data-advice={kind}>
        <span class="tag bad">⚠ {percent(saturated)}</span> {words.overexposed(count(values.n_saturated, chosen))}
      </p>
    );
  }
  if (!values.laser_on) return <p class="advice">{words.laser_off}</p>;
  return (
    <p class="advice" data-advice={kind}>
      {kind === "under" ? words.underexposed(percent(bright)) : words.well_exposed(percent(bright))}
    </p>
  );
}

function Settings({ view }: { view: LiveView | undefined }) {
  const { api, control, station } = useApp();
  const words = text.value.live;
  const form = useForm();
  const wrong = form.blocked.value;
  const blocked = useBlocked() ?? wrong;
  const settings = useMemo(() => new CameraSettings(api, control), [api, control]);
  const camera = station.status.value?.camera;
  const reported = camera && JSON.stringify(camera.settings);
  // Someone else may change the settings: displayed values follow, input is kept.
  useEffect(() => void settings.follow(), [settings, reported]);
  const { exposure_us, gain_db, frame_rate_hz } = settings.draft.value;
  const limits = camera?.capabilities;
  const lit = view?.values.value?.laser_on;
  const unread = settings.problem.value;
  const changed = settings.changed.value;
  const busy = settings.apply.running;
  return (
    <fieldset
      class="stack camera-settings"
      aria-label={words.exposure}
      onKeyDown={(event) => {
        // The field has committed its input before this event.
        const applicable = settings.changed.peek() && !blocked && !form.blocked.peek();
        if (event.key === "Enter" && event.target instanceof HTMLInputElement && applicable) {
          void settings.apply.start();
        }
      }}
    >
      {unread && <ProblemCard problem={unread} />}
      <div class="row end">
        <NumberField
          form={form}
          label={words.exposure_time}
          unit="µs"
          value={exposure_us}
          min={limits?.exposure_us?.min ?? 0}
          max={limits?.exposure_us?.max ?? Number.POSITIVE_INFINITY}
          onChange={(value) => settings.draw({ exposure_us: value })}
        />
        <button
          type="button"
          aria-label={words.halve_exposure}
          aria-disabled={wrong ? "true" : undefined}
          title={wrong ?? words.halve_exposure}
          onClick={() => !wrong && settings.scaleExposure(0.5)}
        >
          ½ ×
        </button>
        <button
          type="button"
          aria-label={words.double_exposure}
          aria-disabled={wrong ? "true" : undefined}
          title={wrong ?? words.double_exposure}
          onClick={() => !wrong && settings.scaleExposure(2)}
        >
          2 ×
        </button>
      </div>
      <div class="row">
        <CommandButton command={settings.auto} blocked={blocked ?? (lit ? undefined : words.auto_needs_light)}>
          {words.auto_exposure}
        </CommandButton>
      </div>
      <div class="row end">
        <NumberField
          form={form}
          label={words.gain}
          unit="dB"
          value={gain_db}
          min={limits?.gain_db?.min ?? 0}
          max={limits?.gain_db?.max ?? Number.POSITIVE_INFINITY}
          onChange={(value) => settings.draw({ gain_db: value })}
        />
        <NumberField
          form={form}
          label={words.frame_rate}
          unit="Hz"
          value={frame_rate_hz}
          min={limits?.frame_rate_hz?.min ?? 0}
          max={limits?.frame_rate_hz?.max ?? Number.POSITIVE_INFINITY}
          onChange={(value) => settings.draw({ frame_rate_hz: value })}
        />
      </div>
      <div class="row">
        <CommandButton
          command={settings.apply}
          kind="primary"
          blocked={blocked ?? (changed || busy || form.pending.value ? undefined : words.nothing_changed)}
        >
          {words.apply}
        </CommandButton>
        {(changed || wrong || form.pending.value) && (
          <button
            type="button"
            onClick={() => {
              settings.discard();
              form.restore();
            }}
          >
            {words.discard}
          </button>
        )}
      </div>
      {settings.note.value === "changed_by_other" && (
        <p class="note" role="status">
          {words.changed_by_other}
        </p>
      )}
      {settings.note.value === "accepted" && (
        <p class="muted" role="status">
          {words.accepted}
        </p>
      )}
    </fieldset>
  );
}
