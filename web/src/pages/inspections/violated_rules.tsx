/** The run rules of control charts that an inspection was the first to violate. */

import type { Schemas } from "../../api/client";
import { href } from "../../state/browser/route";
import type { Inspection } from "../../state/records/inspections";
import { text } from "../../text";
import { chartThen, patternOf } from "./values";

type ViolatedRule = Schemas["ViolatedRule"];

export function ViolatedRules({ inspection }: { inspection: Inspection }) {
  const words = text.value.inspections;
  return (
    <section class="card stack" aria-label={words.run_rules}>
      <h2>{words.run_rules}</h2>
      <p>{words.run_rules_hint}</p>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.characteristic}</th>
            <th>{text.value.statistics.pattern}</th>
            <th>{words.pattern_from}</th>
            <th>{words.chart_then}</th>
          </tr>
        </thead>
        <tbody>
          {inspection.violated_rules.map((violated) => (
            <Row key={`${violated.characteristic}-${violated.rule}`} violated={violated} inspection={inspection} />
          ))}
        </tbody>
      </table>
    </section>
  );
}

function Row({ violated, inspection }: { violated: ViolatedRule; inspection: Inspection }) {
  const words = text.value.inspections;
  const { characteristic, rule, first_inspection_id, n_points } = violated;
  return (
    <tr data-violated-rule={rule}>
      <td data-label={words.characteristic}>
        <strong>{characteristic}</strong>{" "}
        <a href={href("statistics", inspection.recipe.id, { characteristic })}>
          {text.value.statistics.of_characteristic}
          <span class="visually-hidden">: {characteristic}</span>
        </a>
      </td>
      <td data-label={text.value.statistics.pattern}>{patternOf(violated)}</td>
      <td data-label={words.pattern_from}>
        {first_inspection_id === inspection.id ? (
          words.this_part
        ) : (
          <a href={href("inspections", first_inspection_id)}>{words.first_of(n_points)}</a>
        )}
      </td>
      <td class="number" data-label={words.chart_then}>
        {chartThen(violated)}
      </td>
    </tr>
  );
}
