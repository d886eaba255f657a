/** Gauge R&R: variation of the measuring system beside that of the parts. */

import type { ReadonlySignal } from "@preact/signals";
import type { Schemas } from "../../api/client";
import type { Loaded } from "../../state/resource";
import { language, text } from "../../text";
import { count, decimal } from "../../units";
import { Outcome } from "./outcome";

type GaugeRr = Schemas["GaugeRrDto"];

const COMPONENTS = [
  "repeatability",
  "reproducibility",
  "interaction",
  "gauge_rr",
  "part_variation",
  "total_variation",
] as const;

export function GaugeRrCard({ study }: { study: ReadonlySignal<Loaded<GaugeRr>> }) {
  const words = text.value.statistics;
  return (
    <section class="card stack" aria-label={words.gauge_rr}>
      <h2>{words.gauge_rr}</h2>
      <p class="muted">{words.gauge_rr_hint}</p>
      <Outcome of={study}>{(study) => <Study study={study} />}</Outcome>
    </section>
  );
}

function Study({ study }: { study: GaugeRr }) {
  const words = text.value.statistics;
  const percent = (value: number | null | undefined) =>
    value == null ? "–" : `${decimal(value, 1, language.value)} %`;
  return (
    <>
      <table>
        <thead>
          <tr>
            <th>{words.component}</th>
            <th class="number">{words.std_dev}</th>
            <th class="number">{words.of_total}</th>
            <th class="number">{words.of_tolerance}</th>
          </tr>
        </thead>
        <tbody>
          {COMPONENTS.map((name) => {
            const variation = study[name];
            return (
              variation && (
                <tr key={name} data-component={name}>
                  <th scope="row">{words.components[name]}</th>
                  <td class="number nowrap">
                    {decimal(variation.std_dev, 4, language.value)} {study.unit}
                  </td>
                  <td class="number nowrap">{percent(variation.percent_of_total)}</td>
                  <td class="number nowrap">{percent(variation.percent_of_tolerance)}</td>
                </tr>
              )
            );
          })}
        </tbody>
      </table>
      <dl class="facts">
        <dt>{words.ndc}</dt>
        <dd>{count(study.ndc, language.value)}</dd>
        <dt>{words.design}</dt>
        <dd>{words.design_of(study.n_parts, study.n_operators, study.n_trials)}</dd>
      </dl>
    </>
  );
}
