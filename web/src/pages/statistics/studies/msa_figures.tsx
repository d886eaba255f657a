/** The figures of a complete measurement system analysis. */

import type { Schemas } from "../../../api/client";
import { language, text } from "../../../text";
import { count, decimal } from "../../../units";

export function Type1Figures({ figures }: { figures: Schemas["Type1StudyDto"] }) {
  const words = text.value.studies;
  const common = text.value.statistics;
  const number = (value: number | null | undefined, digits: number) => decimal(value, digits, language.value);
  return (
    <section class="card stack" aria-label={words.results}>
      <h2>{words.results}</h2>
      <p class="muted">{common.type_1_means[figures.verdict]}</p>
      <dl class="facts">
        <dt>Cg</dt>
        <dd>{number(figures.cg, 2)}</dd>
        <dt>Cgk</dt>
        <dd>{number(figures.cgk, 2)}</dd>
        <dt>{common.n_values}</dt>
        <dd>{count(figures.n, language.value)}</dd>
        <dt>{common.bias}</dt>
        <dd>
          {number(figures.bias, 4)} {figures.unit} (p = {number(figures.bias_p_value, 3)})
        </dd>
        <dt>{common.std_dev}</dt>
        <dd>
          {number(figures.std_dev, 4)} {figures.unit}
        </dd>
      </dl>
    </section>
  );
}

const COMPONENTS = [
  "repeatability",
  "reproducibility",
  "interaction",
  "gauge_rr",
  "part_variation",
  "total_variation",
] as const;

export function GaugeRrFigures({ figures }: { figures: Schemas["GaugeRrDto"] }) {
  const words = text.value.studies;
  const percent = (value: number | null | undefined) =>
    value == null ? "–" : `${decimal(value, 1, language.value)} %`;
  return (
    <section class="card stack" aria-label={words.results}>
      <h2>{words.results}</h2>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.variation}</th>
            <th class="number">{figures.unit}</th>
            <th class="number">{words.of_total}</th>
            <th class="number">{words.of_tolerance}</th>
          </tr>
        </thead>
        <tbody>
          {COMPONENTS.map((name) => {
            const part = figures[name];
            return (
              part && (
                <tr key={name} data-component={name}>
                  <td data-label={words.variation}>{words.variations[name]}</td>
                  <td class="number" data-label={figures.unit}>
                    {decimal(part.std_dev, 5, language.value)}
                  </td>
                  <td class="number" data-label={words.of_total}>
                    {percent(part.percent_of_total)}
                  </td>
                  <td class="number" data-label={words.of_tolerance}>
                    {percent(part.percent_of_tolerance)}
                  </td>
                </tr>
              )
            );
          })}
        </tbody>
      </table>
      <dl class="facts">
        <dt>{words.ndc}</dt>
        <dd>{count(figures.ndc, language.value)}</dd>
        <dt>{words.design}</dt>
        <dd>{words.design_of(figures.n_parts, figures.n_operators, figures.n_trials)}</dd>
      </dl>
    </section>
  );
}
