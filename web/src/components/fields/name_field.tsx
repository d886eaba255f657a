/** The user's name: shown to others, written to logs, stored in this browser. */

import { useApp } from "../../app";
import { text } from "../../text";

export function NameField() {
  const { control } = useApp();
  return (
    <label class="field">
      <span>{text.value.frame.your_name}</span>
      <input
        value={control.holder.value}
        maxLength={60}
        autocomplete="name"
        onInput={(event) => {
          control.holder.value = event.currentTarget.value;
        }}
      />
    </label>
  );
}
