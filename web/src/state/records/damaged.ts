/** Records of the server that cannot be shown. */

import type { Schemas } from "../../api/client";

export type Damaged = Schemas["DamagedRecordDto"];

/** Appends records that are not in the list yet; returns the same list if there are none. */
export function joinDamaged(known: readonly Damaged[], added: readonly Damaged[] = []): readonly Damaged[] {
  const unknown = added.filter(({ kind, id }) => !known.some((one) => one.kind === kind && one.id === id));
  return unknown.length > 0 ? [...known, ...unknown] : known;
}
