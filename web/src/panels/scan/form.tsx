/** The set-up of a scan. */

import type { Signal } from "@preact/signals";
import type { Form } from "../../parts/fields/form";
import { NumberField } from "../../parts/fields/number_field";
import { text } from "../../text";
import type { Mode, SetUp } from "./set_up";

const MODES: readonly Mode[] = ["stop_and_go", "continuous"];

/** Smallest step and speed that can be typed; the server knows what the station can do. */
const SMALLEST = 0.001;

export function SetUpForm({ set_up, form }: { set_up: SetUp; form: Form }) {
  const words = text.value.scan;
  return (
    <div class="stack">
      <div class="row end travel">
        <Quantity form={form} label={words.from} unit="mm" value={set_up.from_mm} />
        <Quantity form={form} label={words.to} unit="mm" value={set_up.to_mm} />
        {set_up.mode.value === "stop_and_go" ? (
          <Quantity key="step" form={form} label={words.step} unit="mm" value={set_up.step_mm} min={SMALLEST} />
        ) : (
          <Quantity
            key="speed"
            form={form}
            label={words.speed}
            unit="mm/s"
            value={set_up.speed_mm_s}
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
      <label class="field">
        <span>{words.name}</span>
        <input
          value={set_up.name.value}
          maxLength={100}
          autoComplete="off"
          placeholder={words.name_placeholder}
          onInput={(event) => {
            set_up.name.value = event.currentTarget.value;
          }}
        />
      </label>
      <details>
        <summary>{words.light}</summary>
        <div class="stack more">
          <div class="row end">
            <NumberField
              form={form}
              label={words.exposure}
              unit="µs"
              optional
              min={1}
              placeholder={words.automatic}
              value={set_up.exposure_us.value}
              onChange={(value) => {
                set_up.exposure_us.value = value;
              }}
            />
            <NumberField
              form={form}
              label={words.laser_power}
              unit="%"
              optional
              min={0.1}
              max={100}
              placeholder="100"
              value={set_up.laser_percent.value}
              onChange={(value) => {
                set_up.laser_percent.value = value;
              }}
            />
          </div>
          <label class="check">
            <input
              type="checkbox"
              checked={set_up.keep_frames.value}
              onChange={(event) => {
                set_up.keep_frames.value = event.currentTarget.checked;
              }}
            />
            {words.keep_frames}
          </label>
          <label class="check">
            <input
              type="checkbox"
              checked={set_up.record.value}
              onChange={(event) => {
                set_up.record.value = event.currentTarget.checked;
              }}
            />
            {words.record}
          </label>
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

/** A field for a number that must be there. */
function Quantity({ form, label, unit, value, min }: QuantityProperties) {
  const change = (typed: number | undefined) => {
    if (typed !== undefined) value.value = typed;
  };
  return <NumberField form={form} label={label} unit={unit} value={value.value} onChange={change} min={min} />;
}
