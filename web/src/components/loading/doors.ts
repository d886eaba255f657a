/** Loading the doors in a component. */

import type { ReadonlySignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { concernsDoors, type Door } from "../../state/records/doors";
import type { Loaded } from "../../state/resource";
import { useAutoReloaded } from "./auto_reloaded";

/** Refresh interval while the page is visible: successful deliveries cause no events. */
const REFRESH_EVERY_MS = 3000;

/** Loads all doors now, after events about doors, and every few seconds. */
export function useDoors(): { state: ReadonlySignal<Loaded<readonly Door[]>>; reload: () => Promise<void> } {
  const { api } = useApp();
  const doors = useAutoReloaded(
    async (): Promise<readonly Door[]> => (await data(api.GET("/api/v1/doors"))).items,
    concernsDoors,
  );
  const newest = useRef(doors.reload);
  newest.current = doors.reload;
  useEffect(() => {
    let reading = false;
    const timer = setInterval(async () => {
      // At most one request at a time, also if the server is slow.
      if (reading || document.visibilityState === "hidden") return;
      reading = true;
      await newest.current();
      reading = false;
    }, REFRESH_EVERY_MS);
    return () => clearInterval(timer);
  }, []);
  return doors;
}
