/** The station's durable events without gaps: announced by the stream, loaded over HTTP. */

import { signal } from "@preact/signals";
import { type Api, data, type Schemas } from "../../api/client";
import type { StreamConnection } from "../../stream/connection";
import { type Damaged, joinDamaged } from "./damaged";

export type StationEvent = Schemas["EventDto"];

/** Events loaded at the start, and by each request for older ones. */
export const EVENTS_AT_ONCE = 50;

/** Maximum number of events kept in the page. */
const KEPT = 1000;

type Listener = (new_events: readonly StationEvent[]) => void;

/** Prepends new events to the known ones, newest first, without duplicates. */
export function joined(
  known: readonly StationEvent[],
  new_events: readonly StationEvent[],
): readonly StationEvent[] {
  const newest = known[0]?.seq ?? 0;
  const unknown = new_events.filter((event) => event.seq > newest).sort((a, b) => b.seq - a.seq);
  return [...unknown, ...known].slice(0, KEPT);
}

export class EventLog {
  /** Newest first, without gaps. */
  readonly list = signal<readonly StationEvent[]>([]);
  /** Damaged events in the range of the list. */
  readonly damaged = signal<readonly Damaged[]>([]);
  private readonly listeners = new Set<Listener>();
  private newest_seq = 0;
  private reading: Promise<void> | undefined;

  constructor(
    private readonly stream: StreamConnection,
    private readonly api: Api,
  ) {}

  start(): void {
    this.stream.subscribe({ stream: "events" }, (message) => {
      if ("op" in message && message.op === "event") void this.catchUp(message.seq);
    });
    // After a reconnect all data may be outdated, with or without new events.
    this.stream.onReconnect(() => this.notify([]));
  }

  /** Calls back with new events, and with an empty list after a reconnect; returns the function that unsubscribes. */
  follow(listener: Listener): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Whether there are events older than those shown. */
  get hasOlder(): boolean {
    return (this.list.value.at(-1)?.seq ?? 1) > 1 && this.list.value.length < KEPT;
  }

  /** Reads older events. */
  async older(): Promise<void> {
    const oldest = this.list.peek().at(-1)?.seq ?? this.newest_seq + 1;
    const after = Math.max(0, oldest - 1 - EVENTS_AT_ONCE);
    const items = await this.read(after, EVENTS_AT_ONCE);
    const older = items.filter((event) => event.seq < oldest).sort((a, b) => b.seq - a.seq);
    this.list.value = [...this.list.peek(), ...older].slice(0, KEPT);
  }

  private async catchUp(seq: number): Promise<void> {
    if (seq < this.newest_seq) this.list.value = []; // The server now uses another data folder.
    this.newest_seq = seq;
    this.reading ??= this.readNew().finally(() => {
      this.reading = undefined;
    });
    await this.reading;
  }

  private async readNew(): Promise<void> {
    for (;;) {
      const known = this.list.peek()[0]?.seq;
      if (known === this.newest_seq || this.newest_seq === 0) return;
      const after = known ?? Math.max(0, this.newest_seq - EVENTS_AT_ONCE);
      const new_events = await this.read(after, 200).catch(() => undefined);
      // Unreachable: the next message of the stream triggers another attempt.
      if (!new_events || new_events.length === 0) return;
      this.list.value = joined(this.list.peek(), new_events);
      this.notify(new_events);
    }
  }

  private async read(after: number, limit: number): Promise<StationEvent[]> {
    const answer = await data(this.api.GET("/api/v1/events", { params: { query: { after, limit } } }));
    // The same URL also serves an event stream, depending on the Accept header; this request accepts JSON.
    if (typeof answer === "string") throw new Error("the server sent an event stream instead of a list");
    const { items, damaged } = answer;
    this.damaged.value = joinDamaged(this.damaged.peek(), damaged);
    return items;
  }

  private notify(new_events: readonly StationEvent[]): void {
    for (const listener of this.listeners) listener(new_events);
  }
}
