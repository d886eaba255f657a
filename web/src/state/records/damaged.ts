/** Records of the server that cannot be shown. */

import type { Schemas } from "../../api/client";

export type Damaged = Schemas["DamagedRecordDto"];

/** The known ones with the news, each once; the same list where nothing is new. */
export function joinDamaged(known: readonly Damaged[], news: readonly Damaged[] = []): readonly Damaged[] {
  const unknown = news.filter(({ kind, id }) => !known.some((one) => one.kind === kind && one.id === id));
  return unknown.length > 0 ? [...known, ...unknown] : known;
}
