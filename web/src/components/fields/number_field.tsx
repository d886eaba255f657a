/**
 * A field for a number with its unit. Input is committed on Enter or blur, and only if the whole text is a valid
 * number; invalid text remains with an error message and blocks the form.
 */

import { useSignal } from "@preact/signals";
import { useId, useLayoutEffect, useRef } from "preact/hooks";
import { language, text } from "../../text";
import type { Form } from "./form";
import { type Limits, readTyped, written } from "./typed_number";

interface Properties extends Limits {
  /** The form whose commands depend on this field. */
  form: Form;
  label: string;
  unit: string;
  /** `undefined`: empty. */
  value: number | undefined;
  onChange: (value: number | undefined) => void;
  placeholder?: string;
}

export function NumberField(properties: Properties) {
  const { form, label, unit, value } = properties;
  const id = useId();
  const input = useRef<HTMLInputElement>(null);
  const typed = useSignal<string | undefined>(undefined);
  const read = typed.value === undefined ? undefined : readTyped(typed.value, properties, language.value);
  const wrong = read && "wrong" in read ? read.wrong : undefined;
  const blocking = wrong && text.value.common.field_wrong(label, wrong);
  // Runs before the browser handles the next event, such as a click on a dependent button.
  const typing = read !== undefined && "value" in read && read.value !== value;
  useLayoutEffect(() => form.note(id, blocking, typing), [form, id, blocking, typing]);
  useLayoutEffect(() => () => form.note(id, undefined), [form, id]);
  // A new value from outside replaces the text, unless the field has the focus.
  useLayoutEffect(() => {
    if (document.activeElement !== input.current) typed.value = undefined;
  }, [value]);
  const restored = form.restored.value;
  useLayoutEffect(() => {
    typed.value = undefined;
  }, [restored]);
  const commit = () => {
    const read =
      typed.peek() === undefined ? undefined : readTyped(typed.peek() ?? "", properties, language.peek());
    if (!read || "wrong" in read) return;
    typed.value = undefined;
    if (read.value !== value) properties.onChange(read.value);
  };
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <span class="with-unit">
        <input
          ref={input}
          id={id}
          class="number-input"
          inputMode="decimal"
          autoComplete="off"
          placeholder={properties.placeholder}
          value={typed.value ?? written(value, language.value)}
          aria-invalid={wrong ? "true" : undefined}
          aria-describedby={wrong ? `${id}-wrong` : undefined}
          onInput={(event) => {
            typed.value = event.currentTarget.value;
          }}
          onKeyDown={(event) => {
            if (event.key === "Enter") commit();
            else if (event.key === "Escape" && typed.peek() !== undefined) {
              event.preventDefault();
              typed.value = undefined;
            }
          }}
          onBlur={commit}
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
