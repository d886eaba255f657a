/** The Stop button: at the right end of the bar on every page; works for everyone, with or without control. */

import { useEffect, useRef } from "preact/hooks";
import { useApp } from "../app";
import { text } from "../text";

function isStopKey(event: KeyboardEvent): boolean {
  return event.key === "Pause" || ((event.ctrlKey || event.metaKey) && event.key === ".");
}

/** Whether the pointer is on the Stop button while a modal dialog intercepts the event. */
function isBehindDialog(event: PointerEvent, button: Element | null): boolean {
  const box = button?.getBoundingClientRect();
  if (!box || !document.querySelector("dialog:modal")) return false;
  const { clientX: x, clientY: y } = event;
  return x >= box.left && x <= box.right && y >= box.top && y <= box.bottom;
}

export function StopButton() {
  const { stop, station } = useApp();
  const button = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    const onPointer = (event: PointerEvent) => {
      if (isBehindDialog(event, button.current)) stop.press();
    };
    const onKey = (event: KeyboardEvent) => {
      if (!isStopKey(event)) return;
      event.preventDefault();
      stop.press();
    };
    addEventListener("keydown", onKey, { capture: true });
    addEventListener("pointerdown", onPointer, { capture: true });
    return () => {
      removeEventListener("keydown", onKey, { capture: true });
      removeEventListener("pointerdown", onPointer, { capture: true });
    };
  }, [stop]);
  const words = text.value.frame;
  const lit = station.status.value?.laser.light === "not_controlled";
  // Pointer down, not click: sliding off the button must still stop the station.
  return (
    <button
      ref={button}
      type="button"
      class="stop"
      title={lit ? words.stop_hint_lit : words.stop_hint}
      onPointerDown={() => stop.press()}
      // A click without a pointer comes from the keyboard or assistive technology.
      onClick={(event) => {
        if (event.detail === 0) stop.press();
      }}
    >
      {stop.outcome.value === "none" ? words.stop : words.stopping}
    </button>
  );
}
