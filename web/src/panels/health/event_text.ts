/** What an event says beyond its kind. */

import { actorName } from "../../parts/actor";
import { text } from "../../text";

/** The readable part of an event's body; the rest is in the support bundle. */
export function eventDetail({ body }: { body: unknown }): string {
  const fields = (typeof body === "object" && body !== null ? body : {}) as Record<string, unknown>;
  const problem = fields.problem as { detail?: unknown } | null | undefined;
  if (typeof problem?.detail === "string") return problem.detail;
  const words = [
    fields.message ?? fields.reason ?? fields.name,
    fields.from && fields.to ? `${fields.from} → ${fields.to}` : undefined,
    fields.verdict,
  ];
  const plain = words.filter((word) => typeof word === "string" && word !== "");
  if (plain.length > 0) return plain.join(", ");
  return typeof fields.kind === "string" ? fields.kind : "";
}

/** Who did it, and by what way it came; empty where an event does not say. */
export function eventActor({ body }: { body: unknown }): string {
  const fields = (typeof body === "object" && body !== null ? body : {}) as Record<string, unknown>;
  if (typeof fields.actor !== "string" || fields.actor === "") return "";
  const { event_by, event_sources } = text.value.health;
  const source = typeof fields.source === "string" ? (event_sources[fields.source] ?? fields.source) : "";
  return event_by(actorName(fields.actor), source);
}
