/** The results read so far, newest first, kept true by events. */

import { signal } from "@preact/signals";
import { type Api, type Problem, problemOf } from "../../api/client";
import { type Damaged, named } from "../../parts/damaged";
import { Command } from "../../state/command";
import type { EventLog, StationEvent } from "../../state/events";
import { type PartsQuery, readParts, type ScannedPart } from "../../state/scanned";

/** Results read at once. */
const AT_ONCE = 50;

/** Most that the server answers at once. */
const LARGEST_PAGE = 200;

export class ResultsState {
  /** Undefined: not read yet. */
  readonly parts = signal<readonly ScannedPart[] | undefined>(undefined);
  /** Records between them that cannot be shown. */
  readonly damaged = signal<readonly Damaged[]>([]);
  readonly has_older = signal(false);
  readonly problem = signal<Problem | undefined>(undefined);
  readonly older = new Command(() => this.readOlder());
  private query: PartsQuery = {};
  private asked = 0;

  constructor(
    private readonly api: Api,
    private readonly events: EventLog,
  ) {}

  /** Reads what the server finds for `query` from now on. */
  ask(query: PartsQuery): void {
    if (JSON.stringify(query) === JSON.stringify(this.query)) return;
    this.query = query;
    this.parts.value = undefined;
    void this.readNewest();
  }

  /** Reads, and reads again when something happened; the returned function ends it. */
  follow(): () => void {
    void this.readNewest();
    return this.events.follow((news) => {
      if (news.length === 0 || news.some(isOfResults)) void this.readNewest();
    });
  }

  private async readNewest(): Promise<void> {
    this.asked += 1;
    const asked = this.asked;
    try {
      const { parts, damaged, next } = await this.readWhole(Math.max(AT_ONCE, this.parts.peek()?.length ?? 0));
      if (asked !== this.asked) return;
      this.parts.value = parts;
      this.damaged.value = named(damaged);
      this.has_older.value = next !== undefined;
      this.problem.value = undefined;
    } catch (cause) {
      if (asked === this.asked) this.problem.value = problemOf(cause);
    }
  }

  /** The newest `count`: as many as are shown, so that the list keeps its length whatever happens. */
  private async readWhole(count: number): Promise<Awaited<ReturnType<typeof readParts>>> {
    const whole = await readParts(this.api, Math.min(LARGEST_PAGE, count), this.query);
    while (whole.next !== undefined && whole.parts.length < count) {
      const limit = Math.min(LARGEST_PAGE, count - whole.parts.length);
      const page = await readParts(this.api, limit, this.query, whole.next);
      whole.parts.push(...page.parts);
      whole.damaged = [...whole.damaged, ...page.damaged];
      whole.next = page.next;
    }
    return whole;
  }

  private async readOlder(): Promise<void> {
    const known = this.parts.peek() ?? [];
    const asked = this.asked;
    const last = known.at(-1)?.scan.id;
    const { parts, damaged, next } = await readParts(this.api, AT_ONCE, this.query, last);
    // Another filter was chosen meanwhile.
    if (asked !== this.asked) return;
    this.parts.value = [...known, ...parts];
    this.damaged.value = named([...this.damaged.peek(), ...damaged]);
    this.has_older.value = next !== undefined;
  }
}

function isOfResults({ kind }: StationEvent): boolean {
  return kind.startsWith("scan.") || kind.startsWith("measurement.");
}
