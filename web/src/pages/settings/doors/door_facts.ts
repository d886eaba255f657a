/** Names and tags of doors and deliveries. */

import type { Attempt, Door } from "../../../state/records/doors";
import { language, text } from "../../../text";
import { count } from "../../../units";

/** An example configuration, with the command that creates the secret. */
export const EXAMPLE = `[[doors.webhook]]
name = "mes"
url = "https://mes.example.com/hook"
# echo "whsec_$(openssl rand -base64 32)" > /etc/sheaf/mes.secret
secret_file = "/etc/sheaf/mes.secret"`;

/** Class and symbol of the tag of each state: grey unless abnormal. */
export const STATE_TAGS: Record<Door["state"], { style: string; symbol: string }> = {
  delivering: { style: "tag", symbol: "" },
  waiting: { style: "tag caution", symbol: "! " },
  closed: { style: "tag bad", symbol: "✕ " },
};

export function kindName(kind: string): string {
  return text.value.doors.kinds[kind] ?? kind;
}

/** Label of a kind of event, as on the health page. */
export function eventName(kind: string): string {
  return text.value.health.event_kinds[kind] ?? kind;
}

/** Number and kind of the event, or that it was a test message. */
export function attemptName({ seq, kind }: Attempt): string {
  if (seq == null) return text.value.doors.test_message;
  return kind ? `${seq} · ${eventName(kind)}` : String(seq);
}

/** Number of deliveries set aside, waiting or dead. */
export function setAside({ n_waiting, n_dead }: Door): number {
  return n_waiting + n_dead;
}

export function number(value: number): string {
  return count(value, language.value);
}
