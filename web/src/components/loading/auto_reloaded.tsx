/** Server data that are reloaded when an event reports a change. */

import type { ReadonlySignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { useApp } from "../../app";
import { coalesced } from "../../state/coalesced";
import type { StationEvent } from "../../state/records/events";
import type { Loaded } from "../../state/resource";
import { useLoaded } from "./loading";

/** Reloads after every event. */
export const EVERY_EVENT = () => true;

/** Loads now, after events for which `concerns` is true (coalesced), and after a reconnect. */
export function useAutoReloaded<T>(
  load: () => Promise<T>,
  concerns: (event: StationEvent) => boolean = EVERY_EVENT,
  inputs: readonly unknown[] = [],
): { state: ReadonlySignal<Loaded<T>>; reload: () => Promise<void> } {
  const { events } = useApp();
  const loaded = useLoaded(load, inputs);
  const newest = useRef({ reload: loaded.reload, concerns });
  newest.current = { reload: loaded.reload, concerns };
  const reload = useMemo(() => coalesced(() => newest.current.reload()), []);
  useEffect(
    () =>
      events.follow((new_events) => {
        if (new_events.length === 0 || new_events.some(newest.current.concerns)) void reload();
      }),
    [events, reload],
  );
  return loaded;
}
