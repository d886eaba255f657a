/** The user's name: shown to others, written to logs, stored in this browser. */

import { useApp } from "../../app";
import { text } from "../../text";
import { TextField } from "./text_field";

export function NameField() {
  const { control } = useApp();
  return (
    <TextField
      label={text.value.frame.your_name}
      value={control.holder.value}
      maxLength={60}
      autoComplete="name"
      onChange={(name) => (control.holder.value = name)}
    />
  );
}
