/** Stop: alone at the right end of the bar, on every page, for everybody, with or without control. */

import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { text } from "../text";

/** After so long without an answer the person is told to use the machine's own means. */
const ANSWER_WITHIN_MS = 1500;

type Outcome = "none" | "stopping" | "not_reached" | "not_told";

/** What became of the last Stop. */
export const stop_outcome = signal<Outcome>("none");

/** Asks the server to stop; nothing of the page stands between the finger and this request. */
export async function stop(): Promise<void> {
  stop_outcome.value = "stopping";
  try {
    const answer = await fetch("/api/v1/station/stop", {
      method: "POST",
      keepalive: true,
      signal: AbortSignal.timeout(ANSWER_WITHIN_MS),
    });
    const { told } = (await answer.json()) as { told: boolean };
    stop_outcome.value = answer.ok && told ? "none" : "not_told";
  } catch {
    stop_outcome.value = "not_reached";
  }
}

function isStopKey(event: KeyboardEvent): boolean {
  return event.key === "Pause" || ((event.ctrlKey || event.metaKey) && event.key === ".");
}

/** Whether it is on the button while a dialog lies over all of the page and takes what is meant for it. */
function isBehindDialog(event: PointerEvent, button: Element | null): boolean {
  const box = button?.getBoundingClientRect();
  if (!box || !document.querySelector("dialog:modal")) return false;
  const { clientX: x, clientY: y } = event;
  return x >= box.left && x <= box.right && y >= box.top && y <= box.bottom;
}

export function StopButton() {
  const button = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    const onPointer = (event: PointerEvent) => {
      if (isBehindDialog(event, button.current)) void stop();
    };
    const onKey = (event: KeyboardEvent) => {
      if (!isStopKey(event)) return;
      event.preventDefault();
      void stop();
    };
    addEventListener("keydown", onKey, { capture: true });
    addEventListener("pointerdown", onPointer, { capture: true });
    return () => {
      removeEventListener("keydown", onKey, { capture: true });
      removeEventListener("pointerdown", onPointer, { capture: true });
    };
  }, []);
  const words = text.value.frame;
  // Down, not click: a finger that slides off has still asked for a stop.
  return (
    <button
      ref={button}
      type="button"
      class="stop"
      title={words.stop_hint}
      onPointerDown={() => void stop()}
      onClick={byKeyboard}
    >
      {stop_outcome.value === "stopping" ? words.stopping : words.stop}
    </button>
  );
}

/** A click without a pointer comes from the keyboard or an assistive device. */
function byKeyboard(event: MouseEvent): void {
  if (event.detail === 0) void stop();
}
