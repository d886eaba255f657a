/** Settings of board, laser and grating for a new session. */

import type { Schemas } from "../../../api/client";
import type { Target } from "./target";

export interface Draft {
  target: Target;
  wavelength_nm: number;
  grating_lines_per_mm: number;
  orders: number[];
  line_direction: string;
}

export function draftFrom({ target, projector }: Schemas["SessionDefaultsDto"]): Draft {
  return { target, ...projector };
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
