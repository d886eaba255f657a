/** A type-1 study: repeated measurements of one part with a known value. */

import type { ReadonlySignal } from "@preact/signals";
import type { Schemas } from "../../api/client";
import { Choice } from "../../components/fields/choice";
import { useForm } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import type { Loaded } from "../../state/resource";
import { language, text } from "../../text";
import { count, decimal } from "../../units";
import { Outcome } from "./outcome";
import { referenceOf, type Selection } from "./selection";

interface Properties {
  selection: Selection;
  unit: string;
  change: (part: Partial<Selection>) => void;
  /** Undefined while serial number or reference are missing. */
  study: ReadonlySignal<Loaded<Schemas["Type1StudyDto"] | undefined>>;
}

export function Type1Card({ selection, unit, change, study }: Properties) {
  const words = text.value.statistics;
  const form = useForm();
  return (
    <section class="card stack" aria-label={words.type_1}>
      <h2>{words.type_1}</h2>
      <p class="muted">{words.type_1_hint}</p>
      <div class="row end">
        <NumberField
          form={form}
          label={words.reference}
          unit={unit}
          value={referenceOf(selection)}
          optional
          onChange={(reference) => change({ reference: reference === undefined ? "" : `${reference}` })}
        />
        <Choice
          label={words.scatter}
          value={selection.sigmas === "4" ? "4" : ""}
          options={[
            ["", "6 s"],
            ["4", "4 s"],
          ]}
          onChange={(sigmas) => change({ sigmas })}
        />
      </div>
      {selection.serial === "" ? (
        <p>{words.type_1_serial}</p>
      ) : referenceOf(selection) === undefined ? (
        <p>{words.type_1_reference}</p>
      ) : (
        <Outcome of={study}>{(study) => study && <Study study={study} />}</Outcome>
      )}
    </section>
  );
}

function Study({ study }: { study: Schemas["Type1StudyDto"] }) {
  const words = text.value.statistics;
  const written = (value: number) => `${decimal(value, 4, language.value)} ${study.unit}`;
  const number = (value: number | null | undefined, digits = 2) => decimal(value, digits, language.value);
  return (
    <div class="stack" data-verdict={study.verdict}>
      <p>
        <strong>{words.capable[study.verdict]}</strong>{" "}
        <span class="muted">{words.type_1_means[study.verdict]}</span>
      </p>
      <dl class="facts">
        <dt>Cg</dt>
        <dd>{number(study.cg)}</dd>
        <dt>Cgk</dt>
        <dd>{number(study.cgk)}</dd>
        <dt>{words.n_values}</dt>
        <dd>
          {count(study.n, language.value)} {study.n_missing > 0 && words.missing(study.n_missing)}
        </dd>
        <dt>{words.mean}</dt>
        <dd>{written(study.mean)}</dd>
        <dt>{words.bias}</dt>
        <dd>
          {written(study.bias)} (p = {number(study.bias_p_value, 3)})
        </dd>
        <dt>{words.std_dev}</dt>
        <dd>{written(study.std_dev)}</dd>
        <dt>{words.factors}</dt>
        <dd>{words.factors_used(number(100 * study.tolerance_fraction, 0), number(study.n_sigmas, 0))}</dd>
      </dl>
    </div>
  );
}
