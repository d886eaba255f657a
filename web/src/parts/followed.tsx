/** Data of the server that load again when an event says that they changed. */

import type { ReadonlySignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { useApp } from "../app";
import type { StationEvent } from "../state/events";
import { type Loaded, useLoaded } from "./loading";

/** Loads at once, on every event that `concerns` it, and after the link was lost. */
export function useFollowed<T>(
  load: () => Promise<T>,
  concerns: (event: StationEvent) => boolean,
  inputs: readonly unknown[] = [],
): { state: ReadonlySignal<Loaded<T>>; reload: () => Promise<void> } {
  const { events } = useApp();
  const loaded = useLoaded(load, inputs);
  const newest = useRef({ reload: loaded.reload, concerns });
  newest.current = { reload: loaded.reload, concerns };
  useEffect(
    () =>
      events.follow((news) => {
        const { reload, concerns } = newest.current;
        if (news.length === 0 || news.some(concerns)) void reload();
      }),
    [events],
  );
  return loaded;
}
