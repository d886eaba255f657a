/** What an event says beyond its kind. */

import type { StationEvent } from "../../state/events";
import { text } from "../../text";

/** The words of an event's body that a person wants to read; the rest is in the support bundle. */
export function eventDetail({ body }: Pick<StationEvent, "body">): string {
  const told = (typeof body === "object" && body !== null ? body : {}) as Record<string, unknown>;
  const problem = told.problem as { detail?: unknown } | null | undefined;
  if (typeof problem?.detail === "string") return problem.detail;
  const words = [
    told.message ?? told.name,
    told.from && told.to ? `${told.from} → ${told.to}` : undefined,
    told.verdict,
  ];
  const plain = words.filter((word) => typeof word === "string" && word !== "");
  if (plain.length > 0) return plain.join(", ");
  return typeof told.kind === "string" ? told.kind : "";
}

/** Who did it, and by what way it came; empty where an event does not say. */
export function eventActor({ body }: Pick<StationEvent, "body">): string {
  const told = (typeof body === "object" && body !== null ? body : {}) as Record<string, unknown>;
  if (typeof told.actor !== "string" || told.actor === "") return "";
  const { event_by, event_sources } = text.value.health;
  const source = typeof told.source === "string" ? (event_sources[told.source] ?? told.source) : "";
  return event_by(told.actor, source);
}
