/** A text field with its label; every change is passed on as it is typed. */

import type { ComponentProps } from "preact";
import { useId } from "preact/hooks";

type Attributes = Pick<
  ComponentProps<"input">,
  "autoComplete" | "maxLength" | "onKeyDown" | "placeholder" | "spellcheck"
>;

interface Properties extends Attributes {
  label: string;
  /** Further classes of the field. */
  class?: string;
  value: string;
  /** Why the text cannot be used. */
  wrong?: string | false | undefined;
  onChange: (value: string) => void;
}

export function TextField({ label, class: more = "", value, wrong, onChange, ...attributes }: Properties) {
  const id = useId();
  return (
    <div class={`field ${more}`}>
      <label for={id}>{label}</label>
      <input
        autoComplete="off"
        {...attributes}
        id={id}
        value={value}
        aria-invalid={wrong ? "true" : undefined}
        aria-describedby={wrong ? `${id}-wrong` : undefined}
        onInput={(event) => onChange(event.currentTarget.value)}
      />
      {wrong && (
        <span class="wrong" id={`${id}-wrong`}>
          {wrong}
        </span>
      )}
    </div>
  );
}
