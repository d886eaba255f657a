/** The loaded results, newest first, updated by events. */

import type { Api } from "../../api/client";
import type { EventLog } from "../../state/records/events";
import { PagedRecords } from "../../state/records/paged";
import { type PartsQuery, readParts, type ScannedPart } from "../../state/records/scanned";

export class ResultsState extends PagedRecords<ScannedPart, PartsQuery> {
  constructor(api: Api, events: EventLog, query: PartsQuery) {
    const read = async (limit: number, query: PartsQuery, before: string | undefined) => {
      const { parts, ...page } = await readParts(api, limit, query, before);
      return { items: parts, ...page };
    };
    const concerns = ({ kind }: { kind: string }) => kind.startsWith("scan.") || kind.startsWith("measurement.");
    super({ read, concerns }, events, query);
  }

  /** Undefined: not loaded yet. */
  get parts() {
    return this.items;
  }
}
