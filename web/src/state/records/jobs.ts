/** Jobs from the server: the newest state of each, followed until they end. */

import { computed, signal } from "@preact/signals";
import { type Api, data, type Job } from "../../api/client";
import type { StreamConnection } from "../../stream/connection";
import { coalesced } from "../coalesced";
import { type Damaged, joinDamaged } from "./damaged";

/** Jobs kept for the list. */
const KEPT = 1000;

/** Jobs read at once. */
const AT_ONCE = 50;

export function hasEnded(job: Job): boolean {
  return job.state !== "queued" && job.state !== "running";
}

/** What a person called the thing that the job makes. */
export function nameOf(job: Job): string | undefined {
  if (job.input?.kind === "inspection") return job.input.serial;
  return (job.input?.kind === "scan" && job.input.name) || undefined;
}

export class JobsState {
  /** Newest first. */
  readonly list = signal<readonly Job[]>([]);
  /** Jobs that wait or run, oldest first. */
  readonly open = computed(() => this.list.value.filter((job) => !hasEnded(job)).reverse());
  /** Whether the server has jobs older than those in the list. */
  readonly has_older = signal(false);
  /** Jobs between them that are damaged. */
  readonly damaged = signal<readonly Damaged[]>([]);
  private readonly waiting = new Map<string, ((job: Job) => void)[]>();

  constructor(
    private readonly stream: StreamConnection,
    private readonly api: Api,
  ) {}

  start(): void {
    this.stream.subscribe({ stream: "jobs", max_rate_hz: 10 }, (message) => {
      if ("op" in message && message.op === "job") this.update(message.job);
    });
    // Every end of a job is an event; the job stream sends only the newest progress.
    this.stream.subscribe({ stream: "events" }, () => void this.refresh());
    this.stream.onReconnect(() => void this.refresh());
  }

  /** The job as last seen. */
  get(id: string): Job | undefined {
    return this.list.value.find((job) => job.id === id);
  }

  /** Reads the newest jobs again; asked by many at once, it asks the server once more. */
  readonly refresh = coalesced(() => this.readNewest());

  private async readNewest(): Promise<void> {
    try {
      const query = { limit: AT_ONCE };
      const { items, damaged, next } = await data(this.api.GET("/api/v1/jobs", { params: { query } }));
      this.damaged.value = joinDamaged(this.damaged.peek(), damaged);
      // The newest page says whether there is more, unless older pages were read already.
      if (this.list.peek().length <= AT_ONCE) this.has_older.value = next != null;
      for (const job of [...items].reverse()) this.update(job);
    } catch {
      // The link's age is shown; the next event or connection asks again.
    }
  }

  /** Reads jobs older than the oldest in the list. */
  async older(): Promise<void> {
    const before = this.list.peek().at(-1)?.id;
    const query = before === undefined ? { limit: AT_ONCE } : { limit: AT_ONCE, before };
    const { items, damaged, next } = await data(this.api.GET("/api/v1/jobs", { params: { query } }));
    this.damaged.value = joinDamaged(this.damaged.peek(), damaged);
    for (const job of items) this.update(job);
    this.has_older.value = next != null && this.list.peek().length < KEPT;
  }

  /** Notes what a request answered, so that the page need not wait for the stream. */
  update(job: Job): void {
    const known = this.get(job.id);
    if (known && hasEnded(known) && !hasEnded(job)) return;
    if (known && JSON.stringify(known) === JSON.stringify(job)) return;
    const others = this.list.value.filter((other) => other.id !== job.id);
    const at = others.findIndex((other) => other.created_at_ms <= job.created_at_ms);
    others.splice(at < 0 ? others.length : at, 0, job);
    this.list.value = others.slice(0, KEPT);
    if (hasEnded(job)) {
      for (const resolve of this.waiting.get(job.id) ?? []) resolve(job);
      this.waiting.delete(job.id);
    }
  }

  /** Resolves with the job when it has ended, whatever its end. */
  async ended(id: string): Promise<Job> {
    const known = this.get(id);
    if (known && hasEnded(known)) return known;
    return await new Promise((resolve) => {
      this.waiting.set(id, [...(this.waiting.get(id) ?? []), resolve]);
      void this.refresh();
    });
  }
}
