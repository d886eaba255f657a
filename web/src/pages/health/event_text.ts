/** Text of an event in addition to its kind. */

import { fieldOf, textOf } from "../../api/unknown";
import { actorName } from "../../components/actor";
import { text } from "../../text";

/** The readable part of an event's body; the rest is in the support bundle. */
export function eventDetail({ body }: { body: unknown }): string {
  const problem = textOf(fieldOf(body, "problem"), "detail");
  if (problem !== undefined) return problem;
  const [from, to] = [textOf(body, "from"), textOf(body, "to")];
  const parts = [
    textOf(body, "message") ?? textOf(body, "reason") ?? textOf(body, "name"),
    from && to ? `${from} → ${to}` : undefined,
    textOf(body, "verdict"),
  ].filter((part) => part !== undefined);
  return parts.length > 0 ? parts.join(", ") : (textOf(body, "kind") ?? "");
}

/** The person and the interface that caused the event; empty if not given. */
export function eventActor({ body }: { body: unknown }): string {
  const actor = textOf(body, "actor");
  if (actor === undefined) return "";
  const { event_by, event_sources } = text.value.health;
  const source = textOf(body, "source");
  return event_by(actorName(actor), source === undefined ? "" : (event_sources[source] ?? source));
}
