/** Adds a scan of an artefact to an acceptance test. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, idempotencyKey } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Choice, storedOption } from "../../../components/fields/choice";
import { useForm } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { useAutoReloaded } from "../../../components/loading/auto_reloaded";
import { Show } from "../../../components/loading/loading";
import { readParts } from "../../../state/records/scanned";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { PROCEDURES, type Procedure } from "./plan";
import type { Study } from "./study";

/** Scans offered: an acceptance test has up to 38 positions. */
const SCANS_OFFERED = 50;

export function AddPosition({ study, reload }: { study: Study; reload: () => Promise<void> }) {
  const { api } = useApp();
  const words = text.value.studies;
  const form = useForm();
  const planned = PROCEDURES.filter((procedure) => study.plan.acceptance?.[procedure] != null);
  const next = study.missing_positions[0]?.procedure ?? planned[0] ?? "sphere";
  /** Undefined: the first that is not complete. */
  const chosen = useSignal<Procedure | undefined>(undefined);
  const scan = useSignal("");
  const temperature_c = useSignal<number | undefined>(undefined);
  const reference_mm = useSignal<number | undefined>(undefined);
  const procedure = chosen.value ?? next;
  const scans = useAutoReloaded(
    async () => (await readParts(api, SCANS_OFFERED, { state: "complete" })).parts.map(({ scan }) => scan),
    ({ kind }) => kind.startsWith("scan."),
    [api],
  );
  const added = new Set(study.positions.map(({ scan_id }) => scan_id));
  const add = useMemo(
    () =>
      new Command(async () => {
        const params = { path: { id: study.id }, header: { "Idempotency-Key": idempotencyKey() } };
        const temperature = temperature_c.peek();
        const body = {
          procedure,
          scan_id: scan.peek(),
          ...(temperature !== undefined && { temperature_c: temperature }),
          ...(procedure === "linearity" && { reference_mm: reference_mm.peek() ?? 0 }),
        };
        await data(api.POST("/api/v1/studies/{id}/positions", { params, body }));
        [scan.value, reference_mm.value] = ["", undefined];
        await reload();
      }),
    [api, study.id, procedure],
  );
  const missing =
    scan.value === ""
      ? words.choose_scan
      : procedure === "linearity" && reference_mm.value === undefined
        ? words.height_missing
        : undefined;
  return (
    <section class="card stack" aria-label={words.add_position}>
      <h2>{words.add_position}</h2>
      <p class="muted">
        {words.procedures_hint[procedure]} {words.add_hint}
      </p>
      <Show of={scans.state}>
        {(scans) => {
          const offered = scans.filter(({ id }) => !added.has(id));
          if (offered.length === 0) return <p>{words.no_scans}</p>;
          return (
            <div class="row end">
              <Choice
                label={words.procedure}
                value={procedure}
                options={planned.map((one) => [one, words.procedures[one]])}
                onChange={(procedure) => (chosen.value = procedure)}
              />
              <Choice
                label={words.scan}
                value={scan.value}
                options={[["", "–"], ...offered.map(storedOption)]}
                onChange={(id) => (scan.value = id)}
              />
              <NumberField
                form={form}
                label={words.temperature}
                unit="°C"
                value={temperature_c.value}
                min={0}
                max={50}
                optional
                onChange={(value) => (temperature_c.value = value)}
              />
              {procedure === "linearity" && (
                <NumberField
                  form={form}
                  label={words.height}
                  unit="mm"
                  value={reference_mm.value}
                  optional
                  onChange={(value) => (reference_mm.value = value)}
                />
              )}
              <CommandButton command={add} kind="primary" blocked={form.blocked.value ?? missing}>
                {words.add_position}
              </CommandButton>
            </div>
          );
        }}
      </Show>
      {(procedure === "sphere" || procedure === "sphere_pair") && <p class="muted">{words.temperature_hint}</p>}
    </section>
  );
}
