/** A select element with its label. */

import { useId } from "preact/hooks";
import { language } from "../../text";
import { dateTime } from "../../units";

interface Properties<Value extends string | number> {
  label: string;
  value: Value | undefined;
  /** Values with their names. */
  options: readonly (readonly [Value, string])[];
  disabled?: boolean;
  onChange: (value: Value) => void;
}

export function Choice<Value extends string | number>(properties: Properties<Value>) {
  const { label, value, options, disabled, onChange } = properties;
  const id = useId();
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <select
        id={id}
        value={value}
        disabled={disabled}
        onChange={({ currentTarget: { selectedIndex } }) => {
          const chosen = options[selectedIndex];
          if (chosen) onChange(chosen[0]);
        }}
      >
        {options.map(([value, name]) => (
          <option key={value} value={value}>
            {name}
          </option>
        ))}
      </select>
    </div>
  );
}

interface Stored {
  id: string;
  name?: string;
  created_at_ms: number;
}

/** The option for a stored scan or calibration. */
export function storedOption({ id, name = id, created_at_ms }: Stored): readonly [string, string] {
  return [id, `${name} · ${dateTime(created_at_ms, language.value)}`];
}
