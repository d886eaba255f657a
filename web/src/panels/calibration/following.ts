/** Server data that other browsers may change: loaded again with every event and every new connection. */

import { useEffect, useRef } from "preact/hooks";
import { useApp } from "../../app";
import { useLoaded } from "../../parts/loading";
import { coalesced } from "../../state/coalesced";

export function useFollowed<T>(load: () => Promise<T>, inputs: readonly unknown[]) {
  const { stream } = useApp();
  const loaded = useLoaded(load, inputs);
  const newest = useRef(loaded.reload);
  newest.current = loaded.reload;
  useEffect(() => {
    const again = coalesced(() => newest.current());
    const unwant = stream.want({ stream: "events" }, again);
    const unfollow = stream.onReconnect(again);
    return () => {
      unwant();
      unfollow();
    };
  }, inputs);
  return loaded;
}
