/** Capability of the process: Cp, Cpk, Pp, Ppk. */

import type { Schemas } from "../../api/client";
import { language, text } from "../../text";
import { count, decimal } from "../../units";
import type { ControlChart } from "./chart_data";

export function CapabilityCard({ chart }: { chart: ControlChart }) {
  const words = text.value.statistics;
  const { capability, capability_reason, unit, sigma_within } = chart;
  const written = (value: number) => `${decimal(value, 4, language.value)} ${unit}`;
  return (
    <section class="card stack" aria-label={words.capability} data-verdict={capability?.verdict}>
      <h2>{words.capability}</h2>
      {!capability && (
        <p class="muted">
          {words.no_capability} <span lang="en">{capability_reason}</span>
        </p>
      )}
      {capability && (
        <>
          <p>
            <strong>{words.capable[capability.verdict]}</strong>{" "}
            <span class="muted">{words.capable_means[capability.verdict]}</span>
          </p>
          <table class="indices">
            <thead>
              <tr>
                <th>{words.index}</th>
                <th class="number">{words.index_value}</th>
                <th class="number">{words.interval}</th>
                <th class="number">{words.nonconforming}</th>
              </tr>
            </thead>
            <tbody>
              <Indices names={["Cp", "Cpk"]} indices={capability.potential} />
              <Indices names={["Pp", "Ppk"]} indices={capability.performance} />
            </tbody>
          </table>
          <dl class="facts">
            <dt>{words.mean}</dt>
            <dd>{written(capability.mean)}</dd>
            <dt>{words.sigma_within}</dt>
            <dd>{written(sigma_within)}</dd>
            <dt>{words.sigma_overall}</dt>
            <dd>{written(capability.sigma_overall)}</dd>
            <dt>{words.normality}</dt>
            <dd>{decimal(capability.normality_p_value, 3, language.value)}</dd>
          </dl>
        </>
      )}
    </section>
  );
}

interface IndicesProperties {
  /** Names of the index of the tolerance and of that of the nearest limit. */
  names: [string, string];
  indices: Schemas["IndicesDto"];
}

function Indices({ names: [tolerance, nearest], indices }: IndicesProperties) {
  const index = (value: number | null | undefined) => decimal(value, 2, language.value);
  const [low, high] = indices.interval;
  return (
    <>
      <tr data-index={tolerance}>
        <th scope="row">{tolerance}</th>
        <td class="number">{index(indices.tolerance_index)}</td>
        <td class="number" />
        <td class="number" />
      </tr>
      <tr data-index={nearest}>
        <th scope="row">{nearest}</th>
        <td class="number">{index(indices.nearest_index)}</td>
        <td class="number nowrap">
          {index(low)} … {index(high)}
        </td>
        <td class="number nowrap">{count(indices.nonconforming_ppm, language.value)} ppm</td>
      </tr>
    </>
  );
}
