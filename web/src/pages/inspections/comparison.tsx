/** A part compared with its CAD model: statistics, the largest deviations, and the deviations as colours of the cloud. */

import { CommandButton } from "../../components/command_button";
import type { CharacteristicResult } from "../../state/records/inspections";
import { language, text } from "../../text";
import { count, decimal, length } from "../../units";
import type { Comparison, SurfaceDeviations } from "../viewer/surface_deviations";

interface Properties {
  results: readonly CharacteristicResult[];
  /** The cloud of the part; undefined if it was deleted or is not loaded yet. */
  surface: SurfaceDeviations | undefined;
  /** Called after something was shown on the cloud, so that it comes into view. */
  reveal?: (() => void) | undefined;
}

/** One card per characteristic that was compared with a model. */
export function Comparisons({ results, surface, reveal }: Properties) {
  return (
    <>
      {results.map(
        ({ id, comparison }) =>
          comparison && (
            <ComparisonCard key={id} id={id} comparison={comparison} surface={surface} reveal={reveal} />
          ),
      )}
    </>
  );
}

interface CardProperties extends Omit<Properties, "results"> {
  id: string;
  comparison: Comparison;
}

function ComparisonCard({ id, comparison, surface, reveal }: CardProperties) {
  const words = text.value.surface;
  return (
    <section class="card stack comparison" aria-label={words.title(id)} data-comparison={id}>
      <div class="row">
        <h2 class="grow">{words.title(id)}</h2>
        {surface && <ShowDeviations id={id} surface={surface} />}
      </div>
      <Statistics comparison={comparison} />
      {comparison.worst.length > 0 && <Worst id={id} comparison={comparison} surface={surface} reveal={reveal} />}
    </section>
  );
}

function ShowDeviations({ id, surface }: { id: string; surface: SurfaceDeviations }) {
  const words = text.value.surface;
  if (surface.shown.value === id) {
    return (
      <button type="button" aria-pressed="true" onClick={() => surface.hide()}>
        {words.hide}
      </button>
    );
  }
  return <CommandButton command={surface.show(id)}>{words.show}</CommandButton>;
}

function Statistics({ comparison }: { comparison: Comparison }) {
  const words = text.value.surface;
  const { mean_mm, rms_mm, percentiles, fit_rms_mm, covered_mm2, area_mm2, locked } = comparison;
  const { out_of_tolerance_mm2: out_mm2, surely_out_of_tolerance_mm2: surely_mm2 } = comparison;
  const chosen = language.value;
  const area = (value_mm2: number) => decimal(value_mm2, value_mm2 < 10 ? 1 : 0, chosen);
  const share = (part_mm2: number, of_mm2: number) => decimal((100 * part_mm2) / (of_mm2 || 1), 1, chosen);
  return (
    <dl class="facts">
      <dt>{words.rms}</dt>
      <dd>{length(rms_mm, chosen)}</dd>
      <dt>{words.mean}</dt>
      <dd>{signed(mean_mm)}</dd>
      <dt>{words.range}</dt>
      <dd>{words.from_to(signed(percentiles.p2_5_mm), signed(percentiles.p97_5_mm))}</dd>
      <dt>{words.covered}</dt>
      <dd>{words.covered_of(share(covered_mm2, area_mm2), area(covered_mm2), area(area_mm2))}</dd>
      {out_mm2 != null && (
        <>
          <dt>{words.out}</dt>
          <dd>{words.out_of(area(out_mm2), share(out_mm2, covered_mm2))}</dd>
        </>
      )}
      {surely_mm2 != null && (
        <>
          <dt>{words.surely}</dt>
          <dd>{words.out_of(area(surely_mm2), share(surely_mm2, covered_mm2))}</dd>
        </>
      )}
      {fit_rms_mm != null && (
        <>
          <dt>{words.fit}</dt>
          <dd>{length(fit_rms_mm, chosen)}</dd>
        </>
      )}
      {locked.length > 0 && (
        <>
          <dt>{words.locked}</dt>
          <dd lang="en">{locked.join(", ")}</dd>
        </>
      )}
    </dl>
  );
}

function Worst({ id, comparison, surface, reveal }: CardProperties) {
  const words = text.value.surface;
  const chosen = language.value;
  const current = surface?.place.value;
  return (
    <table class="wide" aria-label={words.worst}>
      <caption class="muted">{words.worst}</caption>
      <thead>
        <tr>
          <th class="number">{words.number}</th>
          <th class="number">{words.deviation}</th>
          <th class="number">{text.value.inspections.uncertainty}</th>
          <th class="number">{words.at}</th>
          <th class="number">{words.points}</th>
          {surface && (
            <th>
              <span class="visually-hidden">{words.show_place}</span>
            </th>
          )}
        </tr>
      </thead>
      <tbody>
        {comparison.worst.map(({ deviation_mm, expanded_uncertainty_mm, at_mm, n_points }, idx) => {
          const is_current = current?.id === id && current.idx === idx;
          return (
            <tr key={`${at_mm}`} data-worst={idx} aria-current={is_current ? "true" : undefined}>
              <td class="number" data-label={words.number}>
                {idx + 1}
              </td>
              <td class="number nowrap" data-label={words.deviation}>
                <strong>{signed(deviation_mm)}</strong>
              </td>
              <td class="number nowrap" data-label={text.value.inspections.uncertainty}>
                {length(expanded_uncertainty_mm, chosen)}
              </td>
              <td class="number" data-label={words.at}>
                {at_mm.map((mm) => decimal(mm, 1, chosen)).join(" · ")} mm
              </td>
              <td class="number" data-label={words.points}>
                {count(n_points, chosen)}
              </td>
              {surface && (
                <td>
                  <button
                    type="button"
                    aria-pressed={is_current}
                    onClick={() => {
                      surface.showPlace({ id, idx });
                      reveal?.();
                    }}
                  >
                    {words.show_place}
                    <span class="visually-hidden">: {words.place(idx + 1)}</span>
                  </button>
                </td>
              )}
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}

/** A length with its sign: positive is outside the model. */
function signed(value_mm: number): string {
  return `${value_mm > 0 ? "+" : ""}${length(value_mm, language.value)}`;
}
