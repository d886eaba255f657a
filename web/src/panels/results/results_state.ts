/** The results read so far, newest first, kept true by events. */

import { signal } from "@preact/signals";
import { type Api, type Problem, problemOf } from "../../api/client";
import { type Damaged, named } from "../../parts/damaged";
import { Command } from "../../state/command";
import type { EventLog, StationEvent } from "../../state/events";
import { type ScannedPart, ScannedParts } from "../../state/scanned";

/** Results read at once. */
const AT_ONCE = 50;

export class ResultsState {
  /** Undefined: not read yet. */
  readonly parts = signal<readonly ScannedPart[] | undefined>(undefined);
  /** Records between them that cannot be shown. */
  readonly damaged = signal<readonly Damaged[]>([]);
  readonly has_older = signal(false);
  readonly problem = signal<Problem | undefined>(undefined);
  readonly older = new Command(() => this.readOlder());
  private readonly reader: ScannedParts;
  private asked = 0;

  constructor(
    api: Api,
    private readonly events: EventLog,
  ) {
    this.reader = new ScannedParts(api);
  }

  /** Reads, and reads again when something happened; the returned function ends it. */
  follow(): () => void {
    void this.readNewest();
    return this.events.follow((news) => {
      if (news.length === 0) this.reader.forgetAll();
      if (news.length === 0 || news.some(isOfResults)) void this.readNewest(news);
    });
  }

  private async readNewest(news: readonly StationEvent[] = []): Promise<void> {
    for (const { kind, body } of news) {
      const scan_id = (body as { scan_id?: string } | null)?.scan_id;
      if (kind === "measurement.made" && scan_id) this.reader.forget(scan_id);
    }
    this.asked += 1;
    const asked = this.asked;
    try {
      // As many as are shown, so that a deleted one does not leave a gap.
      const limit = Math.min(200, Math.max(AT_ONCE, this.parts.peek()?.length ?? 0));
      const { parts, damaged, next } = await this.reader.page(limit);
      if (asked !== this.asked) return;
      this.parts.value = parts;
      this.damaged.value = named(damaged);
      this.has_older.value = next !== undefined;
      this.problem.value = undefined;
    } catch (cause) {
      if (asked === this.asked) this.problem.value = problemOf(cause);
    }
  }

  private async readOlder(): Promise<void> {
    const known = this.parts.peek() ?? [];
    const { parts, damaged, next } = await this.reader.page(AT_ONCE, known.at(-1)?.scan.id);
    this.parts.value = [...known, ...parts];
    this.damaged.value = named([...this.damaged.peek(), ...damaged]);
    this.has_older.value = next !== undefined;
  }
}

function isOfResults({ kind }: StationEvent): boolean {
  return kind.startsWith("scan.") || kind === "measurement.made";
}
