/** Settings of board, line projector and exposures for a new session. */

import type { Schemas } from "../../../api/client";
import type { Exposures } from "../exposures/exposures";
import type { Target } from "./target";

export type Projector = Schemas["ProjectorDto"];

export interface Draft {
  target: Target;
  projector: Projector;
  exposures: Exposures;
}

export function draftFrom({ target, projector, exposures }: Schemas["SessionDefaultsDto"]): Draft {
  return { target, projector, exposures };
}

/** The request for a session with these settings. */
export function requestOf(name: string, { target, projector, exposures }: Draft): Schemas["NewSessionDto"] {
  return { name, target, projector, exposures };
}

/** Parses a list of orders with any minus sign; `undefined` if it is not a list of whole numbers. */
export function ordersFrom(text: string): number[] | undefined {
  const parts = text
    .replace(/[−–]/g, "-")
    .split(/[\s,;]+/)
    .filter((part) => part !== "");
  const orders = parts.map(Number);
  const whole = orders.every((order) => Number.isInteger(order) && Math.abs(order) <= 127);
  return whole && orders.length > 0 ? orders : undefined;
}
