/** The name of what is added to the plan. */

import type { Signal } from "@preact/signals";
import { TextField } from "../../components/fields/text_field";
import { text } from "../../text";

export function IdField({ id }: { id: Signal<string> }) {
  return (
    <TextField
      label={text.value.teach.id}
      value={id.value}
      spellcheck={false}
      maxLength={60}
      onChange={(typed) => (id.value = typed.trim())}
    />
  );
}
