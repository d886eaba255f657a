/** The view over the whole window, below the bar: Stop remains within reach. */

import { useSignalEffect } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { ViewState } from "./view_state";

/** F11 and the browser's own full screen follow the state, and the state follows them, if `enabled`. */
export function useFullView(state: ViewState, enabled: boolean): void {
  useSignalEffect(() => {
    const root = document.documentElement;
    // Without permission, and on browsers without it, the view fills the window only.
    if (state.full.value) void root.requestFullscreen?.().catch(() => {});
    else if (document.fullscreenElement) void document.exitFullscreen().catch(() => {});
  });
  useEffect(() => {
    if (!enabled) return;
    const listening = new AbortController();
    const { signal } = listening;
    addEventListener(
      "keydown",
      (event) => {
        if (event.key !== "F11") return;
        event.preventDefault();
        state.full.value = !state.full.peek();
      },
      { signal },
    );
    document.addEventListener(
      "fullscreenchange",
      () => {
        if (!document.fullscreenElement) state.full.value = false;
      },
      { signal },
    );
    return () => {
      listening.abort();
      state.full.value = false;
      if (document.fullscreenElement) void document.exitFullscreen().catch(() => {});
    };
  }, [state, enabled]);
}
