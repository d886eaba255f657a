/** Starts and ends the live view, and sets its laser power. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { ProblemCard } from "../../../components/problem";
import { useBlocked } from "../../../components/station/blocked";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { decimal } from "../../../units";
import { laser_power, useLiveCommands } from "../live_commands";

export function LightCard() {
  const { station } = useApp();
  const { start, end } = useLiveCommands();
  const blocked = useBlocked();
  const words = text.value.live;
  const running = station.status.value?.state === "Operational.ContinuousExecution";
  return (
    <section class="card stack">
      <h2>{words.live_view}</h2>
      {running ? (
        <CommandButton command={end} blocked={blocked}>
          {words.end}
        </CommandButton>
      ) : (
        <CommandButton command={start} blocked={blocked}>
          {words.start}
        </CommandButton>
      )}
      <LaserPower running={running} blocked={blocked} />
    </section>
  );
}

function LaserPower({ running, blocked }: { running: boolean; blocked: string | undefined }) {
  const { api, control, station } = useApp();
  const words = text.value.live;
  const laser = station.status.value?.laser;
  const wanted = useSignal<number | undefined>(undefined);
  const set = useMemo(
    () =>
      new Command(async () => {
        await control.ensure();
        // The slider may have moved while a request was pending: repeat until the last value is sent.
        for (let sent: number | undefined; sent !== wanted.peek(); ) {
          sent = wanted.peek() ?? 0;
          const params = { header: { "Sheaf-Control": control.id() ?? "" } };
          await data(api.PUT("/api/v1/devices/laser", { params, body: { power: sent } }));
        }
      }),
    [api, control, wanted],
  );
  const move = (power: number) => {
    wanted.value = power;
    laser_power.value = power;
    if (running) void set.start();
  };
  // A laser that waits for frames is off for now; the requested power is kept.
  const actual = laser?.light === "on" ? laser.power : laser?.light === "off" ? 0 : undefined;
  const power = wanted.value ?? (running ? actual : undefined) ?? laser_power.value;
  const problem = set.problem.value;
  const step = laser?.powers ? 0.01 : 1;
  return (
    <div class="field">
      <label for="laser-power">{words.laser_power}</label>
      <span class="row slider">
        <input
          id="laser-power"
          type="range"
          class="grow"
          min={0}
          max={1}
          step={step}
          value={power}
          disabled={running && blocked !== undefined}
          title={running ? blocked : undefined}
          aria-valuetext={`${decimal(100 * power, 0, language.value)} %`}
          onInput={(event) => (wanted.value = Number(event.currentTarget.value))}
          onChange={(event) => move(Number(event.currentTarget.value))}
        />
        <span class="number percent">{decimal(100 * power, 0, language.value)} %</span>
      </span>
      <small class="muted">{running ? words.laser_now : words.laser_at_start}</small>
      {problem && <ProblemCard problem={problem} onDismiss={() => set.dismiss()} />}
    </div>
  );
}
