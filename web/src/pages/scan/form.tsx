/** The form of the scan settings. */

import type { Signal } from "@preact/signals";
import { Check } from "../../components/fields/check";
import { Choice } from "../../components/fields/choice";
import type { Form } from "../../components/fields/form";
import { AmbientLevelsField, LaserPowerField } from "../../components/fields/light_fields";
import { NumberField } from "../../components/fields/number_field";
import { TextField } from "../../components/fields/text_field";
import { text } from "../../text";
import { EXPOSURE_COUNTS, MODES } from "./acquisition";
import type { SetUp } from "./set_up";

/** Smallest step and speed of the input fields; the server checks the limits of the station. */
const SMALLEST = 0.001;

export function SetUpForm({ set_up, form }: { set_up: SetUp; form: Form }) {
  const words = text.value.scan;
  const several = set_up.mode.value === "stop_and_go" && set_up.n_exposures.value > 1;
  const range = set_up.rotary.value ? set_up.turn : set_up.travel;
  const unit = set_up.rotary.value ? "°" : "mm";
  return (
    <div class="stack">
      <div class="row end travel" key={unit}>
        <Quantity form={form} label={words.from} unit={unit} value={range.from} />
        <Quantity form={form} label={words.to} unit={unit} value={range.to} />
        {set_up.mode.value === "stop_and_go" ? (
          <Quantity key="step" form={form} label={words.step} unit={unit} value={range.step} min={SMALLEST} />
        ) : (
          <Quantity
            key="speed"
            form={form}
            label={words.speed}
            unit={`${unit}/s`}
            value={range.speed}
            min={SMALLEST}
          />
        )}
      </div>
      <fieldset class="modes">
        <legend class="muted">{words.mode}</legend>
        {MODES.map((mode) => (
          <label class="check" key={mode}>
            <input
              type="radio"
              name="mode"
              checked={set_up.mode.value === mode}
              onChange={() => {
                set_up.mode.value = mode;
              }}
            />
            {words.modes[mode]}
          </label>
        ))}
      </fieldset>
      <TextField
        label={words.name}
        value={set_up.name.value}
        maxLength={100}
        placeholder={words.name_placeholder}
        onChange={(name) => (set_up.name.value = name)}
      />
      <details>
        <summary>{words.light}</summary>
        <div class="stack more">
          <div class="row end">
            <NumberField
              form={form}
              key={several ? "longest" : "one"}
              label={several ? words.longest_exposure : words.exposure}
              unit="µs"
              optional={!several}
              min={1}
              placeholder={words.automatic}
              value={set_up.exposure_us.value}
              onChange={(value) => {
                set_up.exposure_us.value = value;
              }}
            />
            <LaserPowerField
              form={form}
              optional
              value={set_up.laser_power.value}
              onChange={(value) => {
                set_up.laser_power.value = value;
              }}
            />
          </div>
          {set_up.mode.value === "stop_and_go" && (
            <Choice
              label={words.n_exposures}
              value={set_up.n_exposures.value}
              options={EXPOSURE_COUNTS.map((n) => [n, words.exposure_counts(n)])}
              onChange={(n) => set_up.setExposures(n)}
            />
          )}
          <Check
            label={words.keep_frames}
            checked={set_up.keep_frames.value}
            onChange={(checked) => {
              set_up.keep_frames.value = checked;
            }}
          />
          <Check
            label={words.subtract_ambient}
            checked={set_up.subtract_ambient.value}
            onChange={(checked) => {
              set_up.subtract_ambient.value = checked;
            }}
          />
          {set_up.subtract_ambient.value && (
            <div class="row end">
              {set_up.mode.value === "stop_and_go" && (
                <NumberField
                  form={form}
                  label={words.ambient_rows}
                  unit={words.rows_unit}
                  optional
                  whole
                  min={1}
                  placeholder="1"
                  value={set_up.ambient_rows.value}
                  onChange={(value) => {
                    set_up.ambient_rows.value = value;
                  }}
                />
              )}
              <AmbientLevelsField
                form={form}
                optional
                value={set_up.ambient_levels.value}
                onChange={(value) => {
                  set_up.ambient_levels.value = value;
                }}
              />
            </div>
          )}
          <Check
            label={words.record}
            checked={set_up.record.value}
            onChange={(checked) => {
              set_up.record.value = checked;
            }}
          />
        </div>
      </details>
    </div>
  );
}

interface QuantityProperties {
  form: Form;
  label: string;
  unit: string;
  value: Signal<number>;
  min?: number;
}

/** A field for a required number. */
function Quantity({ form, label, unit, value, min }: QuantityProperties) {
  const change = (typed: number | undefined) => {
    if (typed !== undefined) value.value = typed;
  };
  return <NumberField form={form} label={label} unit={unit} value={value.value} onChange={change} min={min} />;
}
