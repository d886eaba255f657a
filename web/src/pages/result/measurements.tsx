/** The measurements with nominal values and verdicts, and a form for new ones. */

import { useEffect, useRef } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { DamagedRecords } from "../../components/dialogs/damaged";
import { Choice } from "../../components/fields/choice";
import { useForm } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { VerdictWord } from "../../components/verdict";
import { TOOLS } from "../../state/choices";
import { language, text } from "../../text";
import { orderName } from "../../theme";
import { count, decimal, length } from "../../units";
import type { ResultState } from "./result_state";
import { featureOf } from "./result_state";
import type { Measurement } from "./scan_record";

/** Radius of the sphere on the simulated stage, mm. */
const SIMULATED_SPHERE_MM = 18.9;

export function Measurements({ result }: { result: ResultState }) {
  const words = text.value.result;
  const measurements = result.measurements.value;
  return (
    <section class="card" aria-label={words.measurements}>
      <h2>{words.measurements}</h2>
      <DamagedRecords rows={result.damaged.value} />
      {measurements.length === 0 && <p class="muted">{words.nothing_measured}</p>}
      {measurements.length > 0 && <Table result={result} />}
      <Selected result={result} />
      {result.view.region.value && <p class="muted">{text.value.teach.region_set}</p>}
      <MeasureForm result={result} />
    </section>
  );
}

function Table({ result }: { result: ResultState }) {
  const words = text.value.result;
  return (
    // biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reached by keys
    <section class="scroll" tabIndex={0} aria-label={words.measurements}>
      <table class="measurements">
        <thead>
          <tr>
            <th>{words.tool}</th>
            <th class="number">{words.nominal}</th>
            <th class="number">{words.tolerance}</th>
            <th class="number">{words.actual}</th>
            <th class="number">{words.error}</th>
            <th class="number">U (k = 2)</th>
            <th class="number">RMSE</th>
            <th>{words.verdict}</th>
            <th>
              <span class="visually-hidden">{words.show_deviation}</span>
            </th>
          </tr>
        </thead>
        <tbody>
          {result.measurements.value.map((measurement) => (
            <Row key={measurement.id} result={result} measurement={measurement} />
          ))}
        </tbody>
      </table>
    </section>
  );
}

function Row({ result, measurement }: { result: ResultState; measurement: Measurement }) {
  const words = text.value.result;
  const measured = measurement.result;
  const shown = language.value;
  const inUnit = (value: number | null | undefined) =>
    value == null ? "–" : `${decimal(value, 4, shown)} ${measured.unit}`;
  const asEntered = (value: number) =>
    `${value.toLocaleString(shown, { maximumFractionDigits: 4 })} ${measured.unit}`;
  // Small lengths in µm; angles in degrees.
  const small = (value: number | null | undefined) =>
    measured.unit === "mm" && value != null ? length(value, shown) : inUnit(value);
  const is_selected = result.selected.value === measurement.id;
  const row = useRef<HTMLTableRowElement>(null);
  const was_selected = useRef(is_selected);
  const from_here = useRef(false);
  useEffect(() => {
    // Not on the first display, which would scroll past the cloud.
    if (is_selected && !was_selected.current && !from_here.current)
      row.current?.scrollIntoView({ block: "nearest" });
    was_selected.current = is_selected;
    from_here.current = false;
  }, [is_selected]);
  return (
    <tr ref={row} aria-selected={is_selected} data-tool={measurement.request.tool}>
      <th scope="row">
        {nameOf(measurement)}
        {measurement.request.name != null && ` “${measurement.request.name}”`}
      </th>
      <td class="number">{measured.nominal == null ? "–" : asEntered(measured.nominal)}</td>
      <td class="number">{measured.tolerance == null ? "–" : `± ${asEntered(measured.tolerance)}`}</td>
      <td class="number">
        <strong>{inUnit(measured.value)}</strong>
      </td>
      <td class="number">{small(measured.error)}</td>
      <td class="number">{small(measured.expanded_uncertainty)}</td>
      <td class="number">{measured.errors ? length(measured.errors.rmse_mm, shown) : "–"}</td>
      <td>
        <VerdictWord verdict={measurement.result.verdict ?? undefined} />
      </td>
      <td>
        {featureOf(measurement) && (
          <button
            type="button"
            aria-label={words.show_deviation}
            onClick={() => {
              // The cloud comes into view, so the row stays where it is.
              from_here.current = !is_selected;
              result.showDeviation(measurement);
              result.view.reveal();
            }}
          >
            {words.show}
          </button>
        )}
      </td>
    </tr>
  );
}

/** Details of the selected measurement: notes, and the values of each order. */
function Selected({ result }: { result: ResultState }) {
  const words = text.value.result;
  const measurement = result.measurements.value.find(({ id }) => id === result.selected.value);
  if (!measurement) return null;
  const measured = measurement.result;
  const shown = language.value;
  return (
    <details class="selected">
      <summary>{words.details(nameOf(measurement))}</summary>
      {measured.notes.map((note) => (
        <p class="plan-note" key={note}>
          {note}
        </p>
      ))}
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reached by keys */}
      <section class="scroll" tabIndex={0} aria-label={words.measurements}>
        <table>
          <thead>
            <tr>
              <th>{words.order}</th>
              <th class="number">{words.n_points}</th>
              <th class="number">{words.actual}</th>
              <th class="number">RMSE</th>
            </tr>
          </thead>
          <tbody>
            {measured.per_order.map((row) => (
              <tr key={row.order}>
                <th scope="row">{orderName(row.order)}</th>
                <td class="number">{count(row.errors.n_points, shown)}</td>
                <td class="number">{row.value_mm == null ? "–" : `${decimal(row.value_mm, 4, shown)} mm`}</td>
                <td class="number">{length(row.errors.rmse_mm, shown)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </section>
    </details>
  );
}

function MeasureForm({ result }: { result: ResultState }) {
  const { api, station } = useApp();
  const words = text.value.result;
  const simulated = station.simulated.value === "twin";
  const form = useForm();
  useEffect(() => {
    // The part on the simulated stage is known.
    if (simulated) void proposeSphere(result, async () => (await data(api.GET("/api/v1/simulation/scene"))).scene);
  }, [result, simulated, api]);
  const unit = result.tool.value === "angle" ? "°" : "mm";
  return (
    <div class="row end measure-form">
      <Choice
        label={words.measure_what}
        value={result.tool.value}
        options={TOOLS.map((tool) => [tool, text.value.measured_as[tool] ?? tool])}
        onChange={(tool) => {
          result.tool.value = tool;
          result.nominal.value = undefined;
          result.tolerance.value = undefined;
        }}
      />
      <NumberField
        key={`nominal-${result.tool.value}`}
        form={form}
        label={words.nominal}
        unit={unit}
        optional
        value={result.nominal.value}
        onChange={(value) => {
          result.nominal.value = value;
        }}
      />
      <NumberField
        key={`tolerance-${result.tool.value}`}
        form={form}
        label={`${words.tolerance} ±`}
        unit={unit}
        optional
        min={1e-6}
        value={result.tolerance.value}
        onChange={(value) => {
          result.tolerance.value = value;
        }}
      />
      <CommandButton
        command={result.measure}
        kind="primary"
        blocked={
          !result.scan.cloud
            ? words.blocked_no_cloud
            : (form.blocked.value ??
              (result.tolerance.value !== undefined &&
                result.nominal.value === undefined &&
                result.tool.value !== "flatness" &&
                words.blocked_nominal))
        }
      >
        {words.measure}
      </CommandButton>
    </div>
  );
}

async function proposeSphere(result: ResultState, scene: () => Promise<string>): Promise<void> {
  const lying = await scene().catch(() => "");
  if (lying === "sphere" && result.tool.peek() === "sphere" && result.nominal.peek() === undefined) {
    result.nominal.value = SIMULATED_SPHERE_MM;
  }
}

function nameOf(measurement: Measurement): string {
  const { tool } = measurement.request;
  return text.value.measured_as[tool] ?? tool;
}
