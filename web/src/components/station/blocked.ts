/** Why manual commands are not possible now. */

import { useApp } from "../../app";
import { text } from "../../text";

/** The reason, or `undefined` if commands are possible. */
export function useBlocked(): string | undefined {
  const { station, control } = useApp();
  const words = text.value.live.blocked;
  const status = station.status.value;
  if (!status || station.stale.value) return words.no_link;
  if (control.other.value !== undefined) return words.other(control.other.value);
  if (status.job_id != null) return words.job;
  if (status.state === "Halted") return words.halted;
  if (status.state === "Error" || status.state === "Preoperational") return words.fault;
  return undefined;
}
