/** Laser power and ambient light, in the forms of scans, recipes and calibration sessions. */

import { text } from "../../text";
import type { Form } from "./form";
import { NumberField } from "./number_field";

interface Properties {
  form: Form;
  /** `undefined`: empty. */
  value: number | undefined;
  /** Whether the field may be empty. */
  optional?: boolean;
  onChange: (value: number | undefined) => void;
}

/** The laser power, typed in percent; the value is a fraction of full power. Empty: full power. */
export function LaserPowerField({ form, value, optional = false, onChange }: Properties) {
  return (
    <NumberField
      form={form}
      label={text.value.scan.laser_power}
      unit="%"
      optional={optional}
      min={0.1}
      max={100}
      placeholder={optional ? "100" : ""}
      value={value === undefined ? undefined : percent(value)}
      onChange={(typed) => onChange(typed === undefined ? undefined : typed / 100)}
    />
  );
}

/** A fraction in percent, without the last digits that multiplication adds. */
function percent(fraction: number): number {
  return Number((100 * fraction).toFixed(6));
}

/** The ambient light above which it is subtracted, grey levels of 255. Empty: it is always subtracted. */
export function AmbientLevelsField({ form, value, optional = false, onChange }: Properties) {
  const words = text.value.scan;
  return (
    <NumberField
      form={form}
      label={words.ambient_levels}
      unit={words.levels_unit}
      optional={optional}
      min={0}
      max={255}
      placeholder={optional ? words.always : ""}
      value={value}
      onChange={onChange}
    />
  );
}
