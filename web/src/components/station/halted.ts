/** After Stop, motion and laser commands are refused until the holder of control resets the station. */

import { useApp } from "../../app";
import { text } from "../../text";

/** Why nothing can be started, or `undefined` if the station is not stopped. */
export function useHalted(): string | undefined {
  const { station } = useApp();
  return station.status.value?.state === "Halted" ? text.value.live.blocked.halted : undefined;
}
