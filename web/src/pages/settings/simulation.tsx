/** The part and the faults of the simulated station. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { useForm } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { useAutoReloaded } from "../../components/loading/auto_reloaded";
import { ProblemCard } from "../../components/problem";
import { SceneChoice } from "../../components/scene_choice";
import { Command } from "../../state/station/command";
import { language, text } from "../../text";
import { FAULTS, type SimulatedFault } from "./faults";

export function Simulation() {
  const { api, station } = useApp();
  const words = text.value.settings;
  const of_simulation = (event: { kind: string }) => event.kind.startsWith("simulation.");
  const faults = useAutoReloaded(
    async () => (await data(api.GET("/api/v1/simulation/faults"))).items,
    of_simulation,
  );
  const on = faults.state.value.value ?? [];
  const { problem } = faults.state.value;
  return (
    <section class="card stack simulation" aria-label={words.simulation}>
      <h2>
        <span class="simulation-word">{text.value.frame.simulated.twin}</span> {words.simulation}
      </h2>
      <p>{words.simulation_hint}</p>
      {problem && <ProblemCard problem={problem} />}
      <SceneChoice busy={station.busy.value} />
      <h3>{words.faults}</h3>
      <ul class="plain fault-list">
        {FAULTS.map((fault) => (
          <FaultRow
            key={fault.name}
            fault={fault}
            on={on.find((one) => one.name === fault.name)}
            reload={faults.reload}
          />
        ))}
      </ul>
    </section>
  );
}

interface FaultProperties {
  fault: SimulatedFault;
  on: Schemas["SimulatedFaultDto"] | undefined;
  reload: () => Promise<void>;
}

function FaultRow({ fault, on, reload }: FaultProperties) {
  const { api } = useApp();
  const words = text.value.settings;
  const value = useSignal(on?.value ?? fault.value?.default_value);
  const form = useForm();
  const command = useMemo(
    () =>
      new Command(async () => {
        const path = { name: fault.name };
        if (on) await data(api.DELETE("/api/v1/simulation/faults/{name}", { params: { path } }));
        else {
          const body = { name: fault.name, ...(fault.value ? { value: value.peek() ?? null } : {}) };
          await data(api.PUT("/api/v1/simulation/faults", { body }));
        }
        await reload();
      }),
    [api, fault, on !== undefined],
  );
  const name = words.fault_names[fault.name] ?? fault.name;
  const shown = on?.value?.toLocaleString(language.value, { maximumFractionDigits: 6 });
  return (
    <li class="fault-row">
      <span class="grow">
        {on && <strong class="tag bad">✕ {words.is_on}</strong>} {name}
        {on && shown && ` (${shown} ${fault.value?.unit ?? ""})`}
      </span>
      {fault.value && !on && (
        <NumberField
          form={form}
          label={words.fault_values[fault.name] ?? ""}
          unit={fault.value.unit}
          value={value.value}
          min={fault.value.min}
          max={fault.value.max}
          onChange={(typed) => {
            value.value = typed;
          }}
        />
      )}
      <CommandButton command={command} blocked={form.blocked.value}>
        {on ? words.switch_off : words.switch_on}
      </CommandButton>
    </li>
  );
}
