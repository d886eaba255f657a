/** The serial number, typed by hand or by a barcode scanner that acts as a keyboard and ends with Enter. */

import type { Signal } from "@preact/signals";
import type { RefObject } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { text } from "../../text";

interface Properties {
  serial: Signal<string>;
  /** Set to the field, for focus from other parts of the page. */
  field?: RefObject<HTMLInputElement | null>;
  placeholder: string;
  /** Starts if possible; returns whether it does. */
  onEnter: () => boolean;
}

export function SerialField({ serial, field, placeholder, onEnter }: Properties) {
  const own = useRef<HTMLInputElement>(null);
  const input = field ?? own;
  useEffect(() => focusOnTyping(input.current), [input]);
  return (
    <div class="field">
      <label for="serial">{text.value.operate.serial}</label>
      <input
        id="serial"
        ref={input}
        class="serial"
        value={serial.value}
        maxLength={100}
        autoComplete="off"
        autoCapitalize="characters"
        spellcheck={false}
        enterkeyhint="go"
        placeholder={placeholder}
        onInput={(event) => {
          serial.value = event.currentTarget.value;
        }}
        onKeyDown={(event) => {
          // The next scan replaces a serial number that could not be used.
          if (event.key === "Enter" && !onEnter()) event.currentTarget.select();
        }}
      />
    </div>
  );
}

/**
 * Moves the focus to the serial number when a character is typed, so that a barcode scanner always works. A list
 * marked `data-yields` gives way, so that a scan never changes its selection.
 */
function focusOnTyping(field: HTMLInputElement | null): () => void {
  field?.focus({ preventScroll: true });
  const onKey = (event: KeyboardEvent) => {
    const printable =
      event.key.length === 1 && event.key !== " " && !event.ctrlKey && !event.metaKey && !event.altKey;
    const elsewhere =
      event.target instanceof Element &&
      event.target.closest("input, select:not([data-yields]), textarea, dialog");
    if (!printable || elsewhere || document.querySelector("dialog[open]")) return;
    field?.focus();
    field?.select();
  };
  addEventListener("keydown", onKey);
  return () => removeEventListener("keydown", onKey);
}
