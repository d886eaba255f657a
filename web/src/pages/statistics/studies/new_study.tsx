/** Creates a study: its kind, its name, and what it examines. */

import { type Signal, useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, idempotencyKey, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Choice } from "../../../components/fields/choice";
import { type Form, useForm } from "../../../components/fields/form";
import { TextField } from "../../../components/fields/text_field";
import { goTo, route } from "../../../state/browser/route";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { AcceptanceForm } from "./acceptance_form";
import { GaugeRrForm, Type1Form } from "./msa_form";
import { type Draft, draftOf, KINDS, planOf, wrongWith } from "./plan";

/** What the parts of the form share. */
export interface DraftForm {
  form: Form;
  draft: Signal<Draft>;
}

export function NewStudy() {
  const { api } = useApp();
  const words = text.value.studies;
  const form = useForm();
  const draft = useSignal<Draft>(draftOf(route.peek().query));
  const change = (part: Partial<Draft>) => (draft.value = { ...draft.peek(), ...part });
  const create = useMemo(
    () =>
      new Command(async () => {
        const plan: Schemas["StudyPlanDto"] = planOf(draft.peek());
        const params = { header: { "Idempotency-Key": idempotencyKey() } };
        const body = { name: draft.peek().name.trim(), plan };
        const study = await data(api.POST("/api/v1/studies", { params, body }));
        goTo("studies", study.id);
      }),
    [api, draft],
  );
  const { kind, name } = draft.value;
  const shared = { form, draft };
  return (
    <section class="card stack" aria-label={words.new_study}>
      <h2>{words.new_study}</h2>
      <div class="row end">
        <Choice
          label={words.kind}
          value={kind}
          options={KINDS.map((one) => [one, words.kinds[one]])}
          onChange={(kind) => change({ kind })}
        />
        <TextField label={words.name} value={name} maxLength={100} onChange={(name) => change({ name })} />
      </div>
      <p class="muted">{words.kinds_hint[kind]}</p>
      {kind === "acceptance" && <AcceptanceForm {...shared} />}
      {kind === "type_1" && <Type1Form {...shared} />}
      {kind === "gauge_rr" && <GaugeRrForm {...shared} />}
      <div class="row">
        <CommandButton
          command={create}
          kind="primary"
          blocked={form.blocked.value ?? wrongWith(draft.value, words)}
        >
          {words.create}
        </CommandButton>
      </div>
    </section>
  );
}
