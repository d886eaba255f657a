/** The artefacts of a new acceptance test with their calibrated values and limits. */

import { Check } from "../../../components/fields/check";
import { NumberField } from "../../../components/fields/number_field";
import { TextField } from "../../../components/fields/text_field";
import { text } from "../../../text";
import type { DraftForm } from "./new_study";
import {
  type DraftArtefact,
  EMPTY_ARTEFACT,
  PROCEDURES,
  type Procedure,
  QUANTITIES,
  VALUES,
  type Value,
} from "./plan";

export function AcceptanceForm({ form, draft }: DraftForm) {
  const words = text.value.studies;
  const { artefacts } = draft.value;
  const put = (procedure: Procedure, artefact: DraftArtefact | undefined) => {
    const { [procedure]: _, ...others } = draft.peek().artefacts;
    const changed = artefact === undefined ? others : { ...others, [procedure]: artefact };
    draft.value = { ...draft.peek(), artefacts: changed };
  };
  return (
    <>
      {PROCEDURES.map((procedure) => {
        const artefact = artefacts[procedure];
        const change = (part: Partial<DraftArtefact>) =>
          put(procedure, { ...(draft.peek().artefacts[procedure] ?? EMPTY_ARTEFACT), ...part });
        return (
          <fieldset key={procedure} class="stack">
            <Check
              label={<strong>{words.procedures[procedure]}</strong>}
              checked={artefact !== undefined}
              onChange={(checked) => put(procedure, checked ? EMPTY_ARTEFACT : undefined)}
            />
            <span class="muted">{words.procedures_hint[procedure]}</span>
            {artefact && (
              <div class="row end">
                <TextField
                  label={words.artefact}
                  value={artefact.artefact}
                  maxLength={100}
                  onChange={(artefact) => change({ artefact })}
                />
                {VALUES[procedure].map((name: Value) => (
                  <NumberField
                    key={name}
                    form={form}
                    label={words[name]}
                    unit={name === "uncertainty" || name === "form" ? "µm" : "mm"}
                    value={artefact.values[name]}
                    min={0}
                    optional
                    onChange={(value) => change({ values: { ...artefact.values, [name]: value } })}
                  />
                ))}
                {QUANTITIES[procedure].map((quantity) => (
                  <NumberField
                    key={quantity}
                    form={form}
                    label={words.mpe(words.quantities[quantity])}
                    unit="µm"
                    value={artefact.limits[quantity]}
                    min={0}
                    optional
                    onChange={(value) => change({ limits: { ...artefact.limits, [quantity]: value } })}
                  />
                ))}
              </div>
            )}
          </fieldset>
        );
      })}
    </>
  );
}
