/** A paged list of records, newest first, updated by events. */

import { computed } from "@preact/signals";
import { Resource } from "../resource";
import { Command } from "../station/command";
import { type Damaged, joinDamaged } from "./damaged";
import type { EventLog, StationEvent } from "./events";

/** Records per page. */
const AT_ONCE = 50;

/** Maximum page size of the server. */
const LARGEST_PAGE = 200;

export interface RecordsPage<Item> {
  items: readonly Item[];
  /** Damaged records in the range of the page. */
  damaged: readonly Damaged[];
  /** Cursor of the next, older page. */
  next: string | undefined;
}

export interface RecordsSource<Item, Query> {
  /** Reads the newest matching records, or those before a cursor. */
  read(limit: number, query: Query, before: string | undefined): Promise<RecordsPage<Item>>;
  /** Whether an event changes the list. */
  concerns(event: StationEvent): boolean;
}

export class PagedRecords<Item, Query> {
  private readonly pages = new Resource<RecordsPage<Item>>();
  /** Undefined: not loaded yet. */
  readonly items = computed(() => this.pages.state.value.value?.items);
  /** Damaged records in the range of the list. */
  readonly damaged = computed(() => this.pages.state.value.value?.damaged ?? []);
  readonly has_older = computed(() => this.pages.state.value.value?.next !== undefined);
  readonly problem = computed(() => this.pages.state.value.problem);
  readonly older = new Command(() => this.readOlder());

  constructor(
    private readonly source: RecordsSource<Item, Query>,
    private readonly events: EventLog,
    private query: Query,
  ) {}

  /** Changes the query and reloads. */
  setQuery(query: Query): void {
    if (JSON.stringify(query) === JSON.stringify(this.query)) return;
    this.query = query;
    this.pages.clear();
    void this.readNewest();
  }

  /** Loads, and reloads after relevant events; returns the function that ends this. */
  follow(): () => void {
    void this.readNewest();
    return this.events.follow((new_events) => {
      if (new_events.length === 0 || new_events.some((event) => this.source.concerns(event)))
        void this.readNewest();
    });
  }

  /** Reloads as many of the newest records as are displayed, so that the list keeps its length. */
  private readNewest(): Promise<void> {
    const count = Math.max(AT_ONCE, this.items.peek()?.length ?? 0);
    return this.pages.load(() => this.more({ items: [], damaged: [], next: undefined }, count));
  }

  private readOlder(): Promise<void> {
    const known = this.pages.state.peek().value ?? { items: [], damaged: [], next: undefined };
    return this.pages.load(() => this.more(known, AT_ONCE));
  }

  /** `known` with up to `count` older records appended. */
  private async more(known: RecordsPage<Item>, count: number): Promise<RecordsPage<Item>> {
    const whole = { ...known };
    const wanted = known.items.length + count;
    do {
      const limit = Math.min(LARGEST_PAGE, wanted - whole.items.length);
      const page = await this.source.read(limit, this.query, whole.next);
      whole.items = [...whole.items, ...page.items];
      whole.damaged = joinDamaged(whole.damaged, page.damaged);
      whole.next = page.next;
    } while (whole.next !== undefined && whole.items.length < wanted);
    return whole;
  }
}
