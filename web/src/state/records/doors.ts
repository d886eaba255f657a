/** Doors to other systems, and the deliveries that they have set aside. */

import { type Api, data, type Schemas } from "../../api/client";
import { type Damaged, joinDamaged } from "./damaged";

export type Door = Schemas["DoorDto"];
export type Attempt = Schemas["AttemptDto"];
export type Delivery = Schemas["DeliveryDto"];

/** Largest page of the API. */
const LARGEST_PAGE = 200;

/** Whether an event changes the state of a door or of its deliveries. */
export function concernsDoors({ kind }: { kind: string }): boolean {
  return kind.startsWith("door.") || kind.startsWith("delivery.");
}

export interface SetAside {
  /** Oldest first. */
  items: readonly Delivery[];
  /** Records between them that are damaged. */
  damaged: readonly Damaged[];
  has_more: boolean;
}

/** Reads the oldest `count` deliveries that a door has set aside. */
export async function readDeliveries(api: Api, name: string, count: number): Promise<SetAside> {
  let [items, damaged]: [readonly Delivery[], readonly Damaged[]] = [[], []];
  for (;;) {
    const limit = Math.min(LARGEST_PAGE, count - items.length);
    const query = { limit, after_seq: items.at(-1)?.event.seq ?? 0 };
    const params = { path: { name }, query };
    const page = await data(api.GET("/api/v1/doors/{name}/deliveries", { params }));
    items = [...items, ...page.items];
    damaged = joinDamaged(damaged, page.damaged);
    const has_more = page.next != null;
    if (!has_more || page.items.length === 0 || items.length >= count) return { items, damaged, has_more };
  }
}
