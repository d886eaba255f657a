/** What an event says beyond its kind. */

import type { StationEvent } from "../../state/events";

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
