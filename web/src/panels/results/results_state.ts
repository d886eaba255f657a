/** The results read so far, newest first, kept true by events. */

import { computed } from "@preact/signals";
import type { Api } from "../../api/client";
import { joinDamaged } from "../../state/records/damaged";
import type { EventLog, StationEvent } from "../../state/records/events";
import { type PartsPage, type PartsQuery, readParts } from "../../state/records/scanned";
import { Resource } from "../../state/resource";
import { Command } from "../../state/station/command";

/** Results read at once. */
const AT_ONCE = 50;

/** Most that the server answers at once. */
const LARGEST_PAGE = 200;

export class ResultsState {
  private readonly pages = new Resource<PartsPage>();
  /** Undefined: not read yet. */
  readonly parts = computed(() => this.pages.state.value.value?.parts);
  /** Records between them that cannot be shown. */
  readonly damaged = computed(() => this.pages.state.value.value?.damaged ?? []);
  readonly has_older = computed(() => this.pages.state.value.value?.next !== undefined);
  readonly problem = computed(() => this.pages.state.value.problem);
  readonly older = new Command(() => this.readOlder());
  private query: PartsQuery = {};

  constructor(
    private readonly api: Api,
    private readonly events: EventLog,
  ) {}

  /** Reads what the server finds for `query` from now on. */
  ask(query: PartsQuery): void {
    if (JSON.stringify(query) === JSON.stringify(this.query)) return;
    this.query = query;
    this.pages.clear();
    void this.readNewest();
  }

  /** Reads, and reads again when something happened; the returned function ends it. */
  follow(): () => void {
    void this.readNewest();
    return this.events.follow((news) => {
      if (news.length === 0 || news.some(isOfResults)) void this.readNewest();
    });
  }

  /** The newest: as many as are shown, so that the list keeps its length whatever happens. */
  private readNewest(): Promise<void> {
    const count = Math.max(AT_ONCE, this.parts.peek()?.length ?? 0);
    return this.pages.load(() => this.more({ parts: [], damaged: [], next: undefined }, count));
  }

  private readOlder(): Promise<void> {
    const known = this.pages.state.peek().value ?? { parts: [], damaged: [], next: undefined };
    return this.pages.load(() => this.more(known, AT_ONCE));
  }

  /** `known`, and up to `count` older ones. */
  private async more(known: PartsPage, count: number): Promise<PartsPage> {
    const whole = { ...known };
    const wanted = known.parts.length + count;
    do {
      const limit = Math.min(LARGEST_PAGE, wanted - whole.parts.length);
      const page = await readParts(this.api, limit, this.query, whole.parts.at(-1)?.scan.id);
      whole.parts = [...whole.parts, ...page.parts];
      whole.damaged = joinDamaged(whole.damaged, page.damaged);
      whole.next = page.next;
    } while (whole.next !== undefined && whole.parts.length < wanted);
    return whole;
  }
}

function isOfResults({ kind }: StationEvent): boolean {
  return kind.startsWith("scan.") || kind.startsWith("measurement.");
}
