/** Settings of board and line projector for a new session. */

import type { Schemas } from "../../../api/client";
import type { Target } from "./target";

export type Projector = Schemas["ProjectorDto"];

export interface Draft {
  target: Target;
  projector: Projector;
}

export function draftFrom({ target, projector }: Schemas["SessionDefaultsDto"]): Draft {
  return { target, projector };
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
