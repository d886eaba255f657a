/** Manual control of the stage: jog, move, home. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { data, type Problem, problemOf } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { useForm } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { ProblemCard } from "../../../components/problem";
import { useBlocked } from "../../../components/station/blocked";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { decimal } from "../../../units";
import { Jog } from "./jog";

/** Speeds offered for jogging, mm/s or °/s. */
const SPEEDS = [0.5, 2, 10, 50];

export function StageCard() {
  const { api, control, station } = useApp();
  const words = text.value.live;
  const stage = station.status.value?.stage;
  const target = useSignal<number | undefined>(undefined);
  const form = useForm();
  const blocked = useBlocked();
  const unhomed = stage?.needs_homing && !stage.homed ? words.home_first : undefined;
  const move = useMemo(
    () =>
      new Command(async () => {
        await control.ensure();
        const params = { header: { "Sheaf-Control": control.id() ?? "" } };
        const at = target.peek() ?? 0;
        const body = station.rotary.peek() ? { target_deg: at } : { target_mm: at };
        await data(api.POST("/api/v1/devices/stage/move", { params, body }));
      }),
    [api, control, station, target],
  );
  const home = useMemo(
    () =>
      new Command(async () => {
        await control.ensure();
        const params = { header: { "Sheaf-Control": control.id() ?? "" } };
        await data(api.POST("/api/v1/devices/stage/home", { params }));
      }),
    [api, control],
  );
  if (stage && !stage.connected) return null;
  const [lowest, highest] = station.travel.value;
  const unit = station.unit.value;
  return (
    <section class="card stack">
      <h2>{words.stage}</h2>
      <p class="row stage-position live-data">
        <span class="big number">{decimal(station.position.value, 3, language.value)}</span> {unit}
        {stage?.moving && <span class="tag">{words.moving}</span>}
      </p>
      <JogButtons blocked={blocked} />
      <div class="row with-button">
        <NumberField
          form={form}
          label={words.target}
          unit={unit}
          value={target.value}
          optional
          min={lowest}
          max={highest}
          onChange={(value) => (target.value = value)}
        />
        <CommandButton
          command={move}
          blocked={
            blocked ??
            unhomed ??
            form.blocked.value ??
            (target.value === undefined && !form.pending.value ? words.target_first : undefined)
          }
        >
          {words.move}
        </CommandButton>
      </div>
      <CommandButton command={home} blocked={blocked}>
        {words.home}
      </CommandButton>
    </section>
  );
}

function JogButtons({ blocked }: { blocked: string | undefined }) {
  const { api, control, station } = useApp();
  const words = text.value.live;
  const problem = useSignal<Problem | undefined>(undefined);
  const speed = useSignal(2);
  const held = useSignal(0);
  const jog = useMemo(
    () =>
      new Jog(
        async (velocity) => {
          await control.ensure();
          const params = { header: { "Sheaf-Control": control.id() ?? "" } };
          const body = station.rotary.peek() ? { velocity_deg_s: velocity } : { velocity_mm_s: velocity };
          await data(api.POST("/api/v1/devices/stage/jog", { params, body }));
        },
        (cause) => {
          held.value = 0;
          problem.value = problemOf(cause);
        },
      ),
    [api, control, held, problem, station],
  );
  const release = () => {
    held.value = 0;
    jog.release();
  };
  // Losing the focus or hiding the page also stops the stage.
  useEffect(() => {
    addEventListener("blur", release);
    document.addEventListener("visibilitychange", release);
    return () => {
      removeEventListener("blur", release);
      document.removeEventListener("visibilitychange", release);
      jog.release();
    };
  }, [jog]);
  const stage = station.status.value?.stage;
  const fastest = stage?.max_speed_mm_s ?? stage?.max_speed_deg_s ?? Number.POSITIVE_INFINITY;
  const button = (sign: 1 | -1, name: string, arrow: string) => (
    <button
      type="button"
      class="jog"
      aria-label={name}
      aria-disabled={blocked ? "true" : undefined}
      title={blocked ?? words.jog_hint}
      aria-pressed={held.value === sign}
      onPointerDown={(event) => {
        if (blocked || event.button !== 0) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        problem.value = undefined;
        held.value = sign;
        jog.hold(sign * speed.value);
      }}
      onPointerUp={release}
      onPointerCancel={release}
      onLostPointerCapture={release}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if (blocked || event.repeat || (event.key !== " " && event.key !== "Enter")) return;
        event.preventDefault();
        problem.value = undefined;
        held.value = sign;
        jog.hold(sign * speed.value);
      }}
      onKeyUp={release}
      onBlur={release}
    >
      {arrow}
    </button>
  );
  return (
    <div class="stack">
      <div class="row jog-row">
        {button(-1, words.jog_back, "◀ −")}
        <label class="field">
          <span class="visually-hidden">{words.speed}</span>
          <select
            value={String(speed.value)}
            onChange={(event) => (speed.value = Number(event.currentTarget.value))}
          >
            {SPEEDS.filter((offered) => offered <= fastest).map((offered) => (
              <option key={offered} value={String(offered)}>
                {decimal(offered, offered < 1 ? 1 : 0, language.value)} {station.unit.value}/s
              </option>
            ))}
          </select>
        </label>
        {button(1, words.jog_forward, "+ ▶")}
      </div>
      <small class="muted">{blocked ?? words.jog_hint}</small>
      {problem.value && <ProblemCard problem={problem.value} onDismiss={() => (problem.value = undefined)} />}
    </div>
  );
}
