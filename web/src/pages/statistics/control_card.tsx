/** The control charts of a characteristic, and the violations of run rules in words. */

import { goTo, href } from "../../state/browser/route";
import { language, text } from "../../text";
import { dateTime, decimal } from "../../units";
import { type ControlChart, individualsOf, movingRangesOf, type Violation } from "./chart_data";
import { ChartView } from "./chart_view";

/** Violations listed. */
const LISTED = 10;

const INDIVIDUALS_PX = 280;
const RANGES_PX = 160;

export function ControlCard({ chart }: { chart: ControlChart }) {
  const words = text.value.statistics;
  const { readings, violations, unit } = chart;
  const written = (value: number) => `${decimal(value, 4, language.value)} ${unit}`;
  const open = (idx: number) => {
    const reading = readings[idx];
    if (reading) goTo("inspections", reading.inspection_id);
  };
  const n = readings.length - chart.n_missing;
  const { lower, centre, upper } = chart.individuals;
  const summary = words.summary(n, written(centre), written(lower), written(upper));
  return (
    <section class="card stack" aria-label={words.control_chart} data-violations={violations.length}>
      <h2>{words.control_chart}</h2>
      <p class={violations.length > 0 ? "out-of-control" : ""} role="status">
        <strong>{violations.length > 0 ? words.violated(violations.length) : words.in_control}</strong>{" "}
        {chart.preliminary && words.preliminary}
      </p>
      <p class="muted number">{summary}</p>
      <ChartView data={individualsOf(chart)} height_px={INDIVIDUALS_PX} label={summary} onPick={open} />
      <h3>{words.moving_ranges}</h3>
      <ChartView
        data={movingRangesOf(chart)}
        height_px={RANGES_PX}
        label={words.ranges_summary(written(chart.moving_range.centre), written(chart.moving_range.upper))}
        onPick={open}
      />
      <p class="muted">
        {words.legend} {chart.n_missing > 0 && words.missing(chart.n_missing)}
      </p>
      {violations.length > 0 && <Violations chart={chart} />}
    </section>
  );
}

/** The newest violations first. */
function Violations({ chart }: { chart: ControlChart }) {
  const words = text.value.statistics;
  const newest = [...chart.violations].sort((a, b) => b.last_idx - a.last_idx || a.rule - b.rule);
  const n_more = newest.length - LISTED;
  return (
    <>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.rule}</th>
            <th>{words.pattern}</th>
            <th>{words.last_part}</th>
            <th>{words.when}</th>
          </tr>
        </thead>
        <tbody>
          {newest.slice(0, LISTED).map((violation) => (
            <Row key={`${violation.rule}-${violation.last_idx}`} chart={chart} violation={violation} />
          ))}
        </tbody>
      </table>
      {n_more > 0 && <p class="muted">{words.more_violations(n_more)}</p>}
    </>
  );
}

function Row({ chart, violation }: { chart: ControlChart; violation: Violation }) {
  const words = text.value.statistics;
  const { rule, first_idx, last_idx } = violation;
  const reading = chart.readings[last_idx];
  return (
    <tr data-rule={rule}>
      <td data-label={words.rule}>{rule}</td>
      <td data-label={words.pattern}>
        {words.rules[rule]} ({words.parts_from_to(first_idx + 1, last_idx + 1)})
      </td>
      <td data-label={words.last_part}>
        {reading ? <a href={href("inspections", reading.inspection_id)}>{reading.serial}</a> : "–"}
      </td>
      <td class="nowrap" data-label={words.when}>
        {dateTime(reading?.at_ms, language.value)}
      </td>
    </tr>
  );
}
