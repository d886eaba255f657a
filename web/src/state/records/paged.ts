/** Records that the server pages, newest first, kept true by events. */

import { computed } from "@preact/signals";
import { Resource } from "../resource";
import { Command } from "../station/command";
import { type Damaged, joinDamaged } from "./damaged";
import type { EventLog, StationEvent } from "./events";

/** Records read at once. */
const AT_ONCE = 50;

/** Most that the server answers at once. */
const LARGEST_PAGE = 200;

export interface RecordsPage<Item> {
  items: readonly Item[];
  /** Records between them that are damaged. */
  damaged: readonly Damaged[];
  /** The cursor of older ones. */
  next: string | undefined;
}

export interface RecordsSource<Item, Query> {
  /** The newest that fit, or those before a cursor. */
  read(limit: number, query: Query, before: string | undefined): Promise<RecordsPage<Item>>;
  /** Whether an event changes the list. */
  concerns(event: StationEvent): boolean;
}

export class PagedRecords<Item, Query> {
  private readonly pages = new Resource<RecordsPage<Item>>();
  /** Undefined: not read yet. */
  readonly items = computed(() => this.pages.state.value.value?.items);
  /** Records between them that cannot be shown. */
  readonly damaged = computed(() => this.pages.state.value.value?.damaged ?? []);
  readonly has_older = computed(() => this.pages.state.value.value?.next !== undefined);
  readonly problem = computed(() => this.pages.state.value.problem);
  readonly older = new Command(() => this.readOlder());

  constructor(
    private readonly source: RecordsSource<Item, Query>,
    private readonly events: EventLog,
    private query: Query,
  ) {}

  /** Reads what the server finds for `query` from now on. */
  setQuery(query: Query): void {
    if (JSON.stringify(query) === JSON.stringify(this.query)) return;
    this.query = query;
    this.pages.clear();
    void this.readNewest();
  }

  /** Reads, and reads again when something happened; the returned function ends it. */
  follow(): () => void {
    void this.readNewest();
    return this.events.follow((new_events) => {
      if (new_events.length === 0 || new_events.some((event) => this.source.concerns(event)))
        void this.readNewest();
    });
  }

  /** The newest: as many as are shown, so that the list keeps its length whatever happens. */
  private readNewest(): Promise<void> {
    const count = Math.max(AT_ONCE, this.items.peek()?.length ?? 0);
    return this.pages.load(() => this.more({ items: [], damaged: [], next: undefined }, count));
  }

  private readOlder(): Promise<void> {
    const known = this.pages.state.peek().value ?? { items: [], damaged: [], next: undefined };
    return this.pages.load(() => this.more(known, AT_ONCE));
  }

  /** `known`, and up to `count` older ones. */
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
