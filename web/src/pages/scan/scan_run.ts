/** The newest scan of the station: its job, live points and result. */

import { computed, effect, type Signal, signal } from "@preact/signals";
import { type Api, data, idempotencyKey, type Job, type Problem, problemOf, type Schemas } from "../../api/client";
import type { App } from "../../app";
import { BlockFeed } from "../../scene/cloud/block_feed";
import { fetchPoints } from "../../scene/cloud/points_source";
import type { CloudViewer } from "../../scene/view/viewer";
import { hasEnded } from "../../state/records/jobs";
import { Command } from "../../state/station/command";
import type { SetUp, StartScan } from "./set_up";

/** Number of newest scans searched for the one of the newest job. */
const N_SEARCHED = 50;

/** A failed search is repeated after this pause: an ended job does not change again. */
const SEARCH_AGAIN_MS = 1000;

export class ScanRun {
  /** The newest job that scans from the station. */
  readonly job = computed<Job | undefined>(() => this.app.jobs.list.value.find(isStationScan));
  /** Whether it is waiting or running. */
  readonly open = computed(() => this.job.value !== undefined && !hasEnded(this.job.value));
  /** The scan whose points are shown. */
  readonly scan_id = signal<string | undefined>(undefined);
  readonly n_blocks = signal(0);
  /** Why points could not be loaded. */
  readonly problem = signal<Problem | undefined>(undefined);
  /** The scan of the newest job, complete or partial. */
  readonly scan: Signal<Schemas["ScanDto"] | undefined> = signal(undefined);
  /** The same if it is partial and can be resumed. */
  readonly partial = computed(() => (this.scan.value?.state === "partial" ? this.scan.value : undefined));
  /** Lost frames of the station at the start of the job, by reason. */
  private readonly lost_before = signal<Record<string, number>>({});
  readonly start: Command;
  /** Resumes the partial scan. */
  readonly resume: Command;

  constructor(
    private readonly app: App,
    set_up: SetUp,
  ) {
    const begin = async (body: StartScan, accepted: () => void) => {
      const job = await startScan(app.api, body);
      app.jobs.update(job);
      accepted();
      await app.jobs.ended(job.id);
    };
    this.start = new Command(async (steps) => await begin(set_up.request.peek(), steps.accepted));
    this.resume = new Command(async (steps) => {
      const resume_scan_id = this.partial.peek()?.id;
      if (resume_scan_id) await begin({ source: { kind: "station" }, resume_scan_id }, steps.accepted);
    });
  }

  /** Frames lost since the start of the job, by reason. */
  readonly lost = computed<[string, number][]>(() => {
    const dropped = this.app.station.status.value?.frames.dropped ?? {};
    const before = this.lost_before.value;
    return Object.entries(dropped).map(([reason, n]) => [reason, Math.max(0, Number(n) - (before[reason] ?? 0))]);
  });

  /** Follows the jobs until the returned function is called. */
  follow(): () => void {
    let job_id: string | undefined;
    const ends = [
      effect(() => {
        const job = this.job.value;
        if (!job || job.id === job_id || hasEnded(job)) return;
        job_id = job.id;
        this.lost_before.value = { ...this.app.station.status.peek()?.frames.dropped };
      }),
      effect(() => {
        const job = this.job.value;
        if (this.scan.peek()?.job_id !== job?.id) this.scan.value = undefined;
        return job && hasEnded(job) ? this.findScan(job) : undefined;
      }),
    ];
    return () => {
      for (const end of ends) end();
    };
  }

  /** Sends points to a viewer until the returned function is called. */
  feed(viewer: CloudViewer): () => void {
    const feed = new BlockFeed(fetchPoints, {
      onBlock: (block) => {
        viewer.append(block);
        this.n_blocks.value = block.block + 1;
      },
      onReset: (scan_id) => {
        viewer.clear();
        this.scan_id.value = scan_id;
        this.n_blocks.value = 0;
        this.problem.value = undefined;
      },
      onProblem: (cause) => {
        const problem = problemOf(cause);
        // A lost connection is shown in the bar; a scan without stored rows is reported by its job.
        if (problem.status !== 0 && problem.status !== 404) this.problem.value = problem;
      },
    });
    const ends = [
      this.app.stream.subscribe({ stream: "points" }, (message) => {
        if ("op" in message) {
          if (message.op === "scan") feed.announce(message);
        } else if (message.kind === "points") feed.receive(message);
      }),
      this.app.stream.onReconnect(() => feed.reconnected()),
    ];
    return () => {
      for (const end of ends) end();
    };
  }

  /** Searches for the scan of an ended job; repeats what failed until the returned function is called. */
  private findScan(job: Job): () => void {
    let ended = false;
    let again: ReturnType<typeof setTimeout> | undefined;
    const search = async () => {
      try {
        const query = { limit: N_SEARCHED };
        const { items } = await data(this.app.api.GET("/api/v1/scans", { params: { query } }));
        if (!ended) this.scan.value = items.find((scan) => scan.job_id === job.id);
      } catch {
        if (!ended) again = setTimeout(() => void search(), SEARCH_AGAIN_MS);
      }
    };
    void search();
    return () => {
      ended = true;
      clearTimeout(again);
    };
  }
}

function isStationScan(job: Job): boolean {
  return job.input?.kind === "scan" && job.input.source.kind === "station";
}

async function startScan(api: Api, body: StartScan): Promise<Job> {
  const params = { header: { "Idempotency-Key": idempotencyKey() } };
  return await data(api.POST("/api/v1/scans", { params, body }));
}
