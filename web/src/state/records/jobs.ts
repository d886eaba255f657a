/** Jobs of the server with their newest states. */

import { computed, signal } from "@preact/signals";
import { type Api, data, type Job } from "../../api/client";
import type { StreamConnection } from "../../stream/connection";
import { coalesced } from "../coalesced";
import { type Damaged, joinDamaged } from "./damaged";

/** Maximum number of jobs kept in the page. */
const KEPT = 1000;

/** Jobs per request. */
const AT_ONCE = 50;

export function hasEnded(job: Job): boolean {
  return job.state !== "queued" && job.state !== "running";
}

/** Name or serial number given by the user. */
export function nameOf(job: Job): string | undefined {
  if (job.input?.kind === "inspection") return job.input.serial;
  return (job.input?.kind === "scan" && job.input.name) || undefined;
}

export class JobsState {
  /** Newest first. */
  readonly list = signal<readonly Job[]>([]);
  /** Waiting and running jobs, oldest first. */
  readonly open = computed(() => this.list.value.filter((job) => !hasEnded(job)).reverse());
  /** Whether the server has jobs older than those in the list. */
  readonly has_older = signal(false);
  /** Damaged jobs in the range of the list. */
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
    // The end of every job is an event; the job stream sends only the newest progress.
    this.stream.subscribe({ stream: "events" }, () => void this.refresh());
    this.stream.onReconnect(() => void this.refresh());
  }

  /** The job as last seen. */
  get(id: string): Job | undefined {
    return this.list.value.find((job) => job.id === id);
  }

  /** Reads the newest jobs again; simultaneous calls are coalesced. */
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
      // The bar shows the lost connection; the next event or reconnect triggers another attempt.
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

  /** Adds or updates a job, from the stream or from a response. */
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

  /** Resolves with the job when it has ended, in any state. */
  async ended(id: string): Promise<Job> {
    const known = this.get(id);
    if (known && hasEnded(known)) return known;
    return await new Promise((resolve) => {
      this.waiting.set(id, [...(this.waiting.get(id) ?? []), resolve]);
      void this.refresh();
    });
  }
}
