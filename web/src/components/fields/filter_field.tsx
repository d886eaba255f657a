/** A field of a filter: text or a day, applied on Enter or blur. */

import type { TargetedEvent } from "preact";
import { useId } from "preact/hooks";

interface Properties {
  label: string;
  type?: "search" | "date";
  placeholder?: string;
  value: string;
  onChange: (value: string) => void;
}

export function FilterField({ label, type = "search", placeholder, value, onChange }: Properties) {
  const id = useId();
  const input = {
    id,
    value,
    onChange: (event: TargetedEvent<HTMLInputElement>) => onChange(event.currentTarget.value.trim()),
  };
  return (
    <div class="field">
      <label for={id}>{label}</label>
      {type === "date" ? (
        <input type="date" {...input} />
      ) : (
        <input type="search" placeholder={placeholder} spellcheck={false} {...input} />
      )}
    </div>
  );
}
