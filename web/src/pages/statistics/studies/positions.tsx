/** The quantities of an acceptance test with their limits, and its positions. */

import type { Schemas } from "../../../api/client";
import { VerdictWord } from "../../../components/verdict";
import { href } from "../../../state/browser/route";
import { language, text } from "../../../text";
import { count, decimal } from "../../../units";
import type { Study } from "./study";

/** A length in µm. */
const um = (value_mm: number | null | undefined) =>
  value_mm == null ? "–" : `${decimal(1e3 * value_mm, 1, language.value)} µm`;

/** The largest uncertainty of the errors; undefined if one of them is unknown. */
function largestU(errors: readonly Schemas["PositionErrorDto"][]): number | undefined {
  const all = errors.map(({ test_uncertainty_mm }) => test_uncertainty_mm ?? Number.NaN);
  const largest = Math.max(...all);
  return all.length === 0 || Number.isNaN(largest) ? undefined : largest;
}

export function Quantities({ study }: { study: Study }) {
  const words = text.value.studies;
  const { quantities = [], linearity, repeatability } = study.acceptance ?? {};
  return (
    <section class="card stack" aria-label={words.results}>
      <h2>{words.results}</h2>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.quantity}</th>
            <th class="number">{words.worst}</th>
            <th class="number">{words.limit}</th>
            <th class="number">{words.test_u}</th>
            <th>{words.verdict}</th>
          </tr>
        </thead>
        <tbody>
          {quantities.map(({ quantity, worst_mm, mpe_mm, errors, verdict }) => (
            <tr key={quantity} data-quantity={quantity}>
              <td data-label={words.quantity}>{words.quantities[quantity]}</td>
              <td class="number" data-label={words.worst}>
                {um(worst_mm)}
              </td>
              <td class="number" data-label={words.limit}>
                {um(mpe_mm)}
              </td>
              <td class="number" data-label={words.test_u}>
                {errors.length > 0 && largestU(errors) === undefined ? words.no_temperature : um(largestU(errors))}
              </td>
              <td data-label={words.verdict}>
                <VerdictWord verdict={verdict ?? undefined} />
              </td>
            </tr>
          ))}
        </tbody>
      </table>
      {linearity && (
        <dl class="facts">
          <dt>{words.slope}</dt>
          <dd>{decimal(linearity.slope, 6, language.value)}</dd>
          <dt>{words.of_full_scale}</dt>
          <dd>
            {decimal(linearity.percent_of_range, 4, language.value)} % (
            {decimal(linearity.range_mm, 3, language.value)} mm)
          </dd>
          <dt>{words.averaged}</dt>
          <dd>{count(linearity.n_averaged, language.value)}</dd>
        </dl>
      )}
      {repeatability && (
        <dl class="facts">
          <dt>{words.scans}</dt>
          <dd>{count(repeatability.n_scans, language.value)}</dd>
          <dt>{words.averaged}</dt>
          <dd>{count(repeatability.n_averaged, language.value)}</dd>
        </dl>
      )}
    </section>
  );
}

export function Positions({ study }: { study: Study }) {
  const words = text.value.studies;
  if (study.positions.length === 0) return null;
  return (
    <section class="card stack" aria-label={words.positions}>
      <h2>{words.positions}</h2>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.scan}</th>
            <th>{words.procedure}</th>
            <th class="number">°C</th>
            <th class="number">{words.points}</th>
            <th class="number">{words.rejected}</th>
            <th class="number">{words.range}</th>
            <th class="number">{words.band}</th>
          </tr>
        </thead>
        <tbody>
          {study.positions.map((position) => (
            <tr key={position.scan_id}>
              <td data-label={words.scan}>
                <a class="name" href={href("result", position.scan_id)}>
                  {position.scan_name}
                </a>
              </td>
              <td data-label={words.procedure}>{words.procedures[position.procedure]}</td>
              <td class="number" data-label="°C">
                {decimal(position.temperature_c, 1, language.value)}
              </td>
              <td class="number" data-label={words.points}>
                {position.features.map(({ n_points }) => count(n_points, language.value)).join(" / ")}
              </td>
              <td class="number" data-label={words.rejected}>
                {position.features.map(({ n_rejected }) => count(n_rejected, language.value)).join(" / ")}
              </td>
              <td class="number" data-label={words.range}>
                {position.features.map(({ range_mm }) => um(range_mm)).join(" / ")}
              </td>
              <td class="number" data-label={words.band}>
                {position.features.map(({ d95_mm }) => um(d95_mm)).join(" / ")}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </section>
  );
}
