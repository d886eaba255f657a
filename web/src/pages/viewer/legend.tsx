/** The legend: orders with their names, or a scale with histogram and adjustable range. */

import { Check } from "../../components/fields/check";
import { useForm } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { binned } from "../../scene/cloud/histogram";
import { gradient, type ValueMode } from "../../scene/colours";
import { language, text } from "../../text";
import { orderColour, orderName } from "../../theme";
import { decimal } from "../../units";
import type { ViewState } from "./view_state";

const N_BINS = 64;

/** Height of the histogram in SVG units. */
const HISTOGRAM_HEIGHT = 32;

const UNITS: Record<ValueMode, string> = { height: "mm", sigma: "µm", intensity: "", deviation: "µm" };

/** Orders shown in the legend. */
const ORDERS = [-2, -1, 0, 1, 2];

export function Legend({ state }: { state: ViewState }) {
  const mode = state.mode.value;
  return (
    <div class="cloud-legend live-data">
      {mode === "order" ? <OrderLegend /> : <ScaleLegend state={state} mode={mode} />}
      <ModelColours state={state} />
    </div>
  );
}

/** What the colours of deviations from a CAD model mean. */
function ModelColours({ state }: { state: ViewState }) {
  const is_shown = state.mode.value === "deviation" && state.feature.value?.shape.kind === "model";
  return is_shown ? <small class="muted">{text.value.viewer.model_colours}</small> : null;
}

function OrderLegend() {
  const words = text.value.viewer;
  return (
    <ul class="row order-legend" aria-label={words.modes.order}>
      <li class="muted">{words.order_title}</li>
      {ORDERS.map((order) => (
        <li key={order} class="row">
          <span class="swatch" style={{ background: orderColour(order) }} />
          <span class="number">{orderName(order)}</span>
        </li>
      ))}
    </ul>
  );
}

function ScaleLegend({ state, mode }: { state: ViewState; mode: ValueMode }) {
  const words = text.value.viewer;
  const range = state.range.value;
  const unit = UNITS[mode];
  const form = useForm();
  const automatic = state.custom_ranges.value[mode] === undefined;
  const rounded = (value: number) => Number(value.toPrecision(3));
  return (
    <div class="row end scale-legend">
      <NumberField
        key={`${mode}-low`}
        form={form}
        label={words.low}
        unit={unit}
        value={rounded(range.low)}
        max={range.high}
        onChange={(low) => low !== undefined && state.setRange({ ...range, low })}
      />
      <ColourScale state={state} mode={mode} />
      <NumberField
        key={`${mode}-high`}
        form={form}
        label={words.high}
        unit={unit}
        value={rounded(range.high)}
        min={range.low}
        onChange={(high) => high !== undefined && state.setRange({ ...range, high })}
      />
      <div class="stack scale-options">
        <Check
          label={words.hide_outside}
          checked={state.hide_outside.value}
          onChange={(checked) => (state.hide_outside.value = checked)}
        />
        <button type="button" disabled={automatic} onClick={() => state.setRange(undefined)}>
          {automatic ? words.automatic_on : words.automatic}
        </button>
      </div>
    </div>
  );
}

/** The colour scale without controls, also for printing. */
function ColourScale({ state, mode }: { state: ViewState; mode: ValueMode }) {
  const words = text.value.viewer;
  const range = state.range.value;
  const bins = binned(state.values.value, range, N_BINS);
  const most = Math.max(1, ...bins);
  const unit = UNITS[mode];
  return (
    <figure class="grow scale">
      <figcaption class="muted">
        {words.scale[mode]}
        {mode === "deviation" && ` (${words.shapes[state.shape_name.value] ?? state.shape_name.value})`}
        {unit !== "" && `, ${unit}`}
      </figcaption>
      <svg
        viewBox={`0 0 ${N_BINS} ${HISTOGRAM_HEIGHT}`}
        preserveAspectRatio="none"
        role="img"
        aria-label={words.histogram}
      >
        {bins.map((n, bin) => {
          const high = (HISTOGRAM_HEIGHT * n) / most;
          return <rect key={bin} x={bin} y={HISTOGRAM_HEIGHT - high} width={0.9} height={high} />;
        })}
      </svg>
      <div class="gradient" style={{ background: gradient(mode) }} />
      <div class="ticks number" aria-hidden="true">
        {[0, 0.25, 0.5, 0.75, 1].map((share) => (
          <span key={share}>
            {decimal(
              range.low + share * (range.high - range.low),
              digitsOf(range.high - range.low),
              language.value,
            )}
          </span>
        ))}
      </div>
    </figure>
  );
}

/** The legend for printing. */
export function PrintedLegend({ state }: { state: ViewState }) {
  const mode = state.mode.value;
  return (
    <div class="printed-legend">
      {mode === "order" ? <OrderLegend /> : <ColourScale state={state} mode={mode} />}
      <ModelColours state={state} />
    </div>
  );
}

/** Number of decimals that distinguishes the ticks of a span. */
function digitsOf(span: number): number {
  return Math.max(0, Math.min(4, 1 - Math.floor(Math.log10(Math.max(span, 1e-9) / 4))));
}
