/** The exposures of a session: their values, and the fields to enter them. */

import { useRef } from "preact/hooks";
import { useApp } from "../../../app";
import { Check } from "../../../components/fields/check";
import type { Form } from "../../../components/fields/form";
import { AmbientLevelsField, LaserPowerField } from "../../../components/fields/light_fields";
import { NumberField } from "../../../components/fields/number_field";
import { written } from "../../../components/fields/typed_number";
import { language, text } from "../../../text";
import { AMBIENT_LEVELS, type Exposures, withSubtraction } from "./exposures";

/** The values, read-only. */
export function ExposureFacts({ exposures }: { exposures: Exposures }) {
  const words = text.value.calibration;
  const number = (value: number) => written(value, language.value);
  const { background_above_levels } = exposures;
  return (
    <dl class="facts">
      <dt>{words.board_exposure}</dt>
      <dd>{number(exposures.board_exposure_us)} µs</dd>
      <dt>{words.laser_exposure}</dt>
      <dd>{number(exposures.laser_exposure_us)} µs</dd>
      <dt>{text.value.scan.laser_power}</dt>
      <dd>{number(100 * exposures.laser_power)} %</dd>
      <dt>{words.ambient}</dt>
      <dd>
        {background_above_levels == null
          ? words.ambient_kept
          : words.ambient_above(number(background_above_levels))}
      </dd>
    </dl>
  );
}

interface Properties {
  form: Form;
  exposures: Exposures;
  onChange: (changed: Partial<Exposures>) => void;
}

export function ExposureFields({ form, exposures, onChange }: Properties) {
  const { board_exposure_us, laser_exposure_us, laser_power, background_above_levels } = exposures;
  const words = text.value.calibration;
  const subtracts = background_above_levels != null;
  // The limit while ambient light is not subtracted.
  const limit_levels = useRef(AMBIENT_LEVELS);
  if (subtracts) limit_levels.current = background_above_levels;
  return (
    <>
      <div class="row end">
        <Exposure
          form={form}
          label={words.board_exposure}
          value={board_exposure_us}
          onChange={(board_exposure_us) => onChange({ board_exposure_us })}
        />
        <Exposure
          form={form}
          label={words.laser_exposure}
          value={laser_exposure_us}
          onChange={(laser_exposure_us) => onChange({ laser_exposure_us })}
        />
        <LaserPowerField
          form={form}
          value={laser_power}
          onChange={(laser_power) => laser_power !== undefined && onChange({ laser_power })}
        />
      </div>
      <Check
        label={text.value.scan.subtract_ambient}
        checked={subtracts}
        onChange={(checked) => onChange(withSubtraction(checked, limit_levels.current))}
      />
      {subtracts && (
        <div class="row end">
          <AmbientLevelsField
            form={form}
            value={background_above_levels}
            onChange={(levels) => levels !== undefined && onChange(withSubtraction(true, levels))}
          />
        </div>
      )}
    </>
  );
}

interface ExposureProperties {
  form: Form;
  label: string;
  value: number;
  onChange: (value_us: number) => void;
}

/** An exposure within the limits of the camera. */
function Exposure({ form, label, value, onChange }: ExposureProperties) {
  const limits = useApp().station.status.value?.camera.capabilities?.exposure_us;
  return (
    <NumberField
      form={form}
      label={label}
      unit="µs"
      value={value}
      min={limits?.min ?? 1}
      max={limits?.max}
      onChange={(value_us) => value_us !== undefined && onChange(value_us)}
    />
  );
}
