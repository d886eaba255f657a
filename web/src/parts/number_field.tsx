/** A field for a number with its unit; takes decimal comma and point, and says what is wrong. */

import { useSignal } from "@preact/signals";
import { useId } from "preact/hooks";
import { language, text } from "../text";
import { decimal, parseDecimal } from "../units";

interface Properties {
  label: string;
  unit: string;
  /** `undefined`: empty. */
  value: number | undefined;
  onChange: (value: number | undefined) => void;
  min?: number;
  max?: number;
  /** Whether it may stay empty. */
  optional?: boolean;
  placeholder?: string;
}

export function NumberField(properties: Properties) {
  const { label, unit, value, min = Number.NEGATIVE_INFINITY, max = Number.POSITIVE_INFINITY } = properties;
  const id = useId();
  const typed = useSignal<string | undefined>(undefined);
  const wrong = problemOf(typed.value, properties.optional ?? false, min, max);
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <span class="with-unit">
        <input
          id={id}
          inputMode="decimal"
          autoComplete="off"
          placeholder={properties.placeholder}
          value={typed.value ?? written(value)}
          aria-invalid={wrong ? "true" : undefined}
          aria-describedby={wrong ? `${id}-wrong` : undefined}
          onInput={(event) => {
            typed.value = event.currentTarget.value;
            const parsed = parseDecimal(typed.value);
            const empty = typed.value.trim() === "";
            if (empty && properties.optional) properties.onChange(undefined);
            else if (parsed !== undefined && parsed >= min && parsed <= max) properties.onChange(parsed);
          }}
          onBlur={() => {
            // A wrong text stays, so that it can be mended.
            if (!wrong) typed.value = undefined;
          }}
        />
        <span class="muted">{unit}</span>
      </span>
      {wrong && (
        <span class="wrong" id={`${id}-wrong`}>
          {wrong}
        </span>
      )}
    </div>
  );
}

function written(value: number | undefined): string {
  if (value === undefined) return "";
  return value.toLocaleString(language.value, { maximumFractionDigits: 6, useGrouping: false });
}

function problemOf(typed: string | undefined, optional: boolean, min: number, max: number): string | undefined {
  if (typed === undefined || (typed.trim() === "" && optional)) return undefined;
  const words = text.value.parts;
  const parsed = parseDecimal(typed);
  if (parsed === undefined) return words.not_a_number;
  const shown = (limit: number) => (Number.isFinite(limit) ? decimal(limit, 3, language.value) : "∞");
  return parsed < min || parsed > max ? words.out_of_range(shown(min), shown(max)) : undefined;
}
