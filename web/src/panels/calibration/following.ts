/** Server data that other browsers may change: loaded again with every event and every new connection. */

import { useEffect } from "preact/hooks";
import { useApp } from "../../app";
import { useLoaded } from "../../parts/loading";

export function useFollowed<T>(load: () => Promise<T>, inputs: readonly unknown[]) {
  const { stream } = useApp();
  const loaded = useLoaded(load, inputs);
  useEffect(() => {
    const again = () => void loaded.reload();
    const unwant = stream.want({ stream: "events" }, again);
    const unfollow = stream.onReconnect(again);
    return () => {
      unwant();
      unfollow();
    };
  }, inputs);
  return loaded;
}
