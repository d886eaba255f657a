/** Records of the server that cannot be shown. */

import type { Schemas } from "../../api/client";

export type Damaged = Schemas["DamagedRecordDto"];

/** The known ones with the added, each once; the same list where nothing is new. */
export function joinDamaged(known: readonly Damaged[], added: readonly Damaged[] = []): readonly Damaged[] {
  const unknown = added.filter(({ kind, id }) => !known.some((one) => one.kind === kind && one.id === id));
  return unknown.length > 0 ? [...known, ...unknown] : known;
}
