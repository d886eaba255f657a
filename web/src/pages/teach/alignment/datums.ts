/** The choice of three datums, and why a plan cannot be aligned by them, or be without them. */

import type { Plan } from "../draft";
import type { Alignment } from "./frame";

/** In order of precedence. */
export const DATUMS = ["primary", "secondary", "tertiary"] as const;

export const NO_DATUMS: Alignment = { primary: "", secondary: "", tertiary: "" };

/** What is wrong with a choice; an id that is not `offered` is none. */
export function datumsFault(chosen: Alignment, offered: readonly string[]): "missing" | "repeated" | undefined {
  const ids = DATUMS.map((datum) => chosen[datum]);
  if (!ids.every((id) => offered.includes(id))) return "missing";
  return new Set(ids).size < ids.length ? "repeated" : undefined;
}

/** Measures that the server evaluates in a datum frame only. */
const IN_DATUM_FRAME: readonly string[] = ["coordinate", "position", "profile"];

/**
 * Ids of the characteristics that keep a plan from being aligned, or from being without its alignment: those with a
 * place in the present frame, which would mean something else in another.
 */
export function boundToFrame({ alignment, characteristics }: Plan): readonly string[] {
  const isBound = ({ measure }: Plan["characteristics"][number]) =>
    measure.type === "surface_profile" ||
    (alignment != null &&
      (IN_DATUM_FRAME.includes(measure.type) ||
        ("along" in measure && measure.along != null) ||
        ("about" in measure && measure.about != null)));
  return characteristics.filter(isBound).map(({ id }) => id);
}
