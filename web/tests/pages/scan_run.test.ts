/** The newest scan of the station, from jobs and answers without a server. */

import { computed, signal } from "@preact/signals";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Job, Schemas } from "../../src/api/client";
import type { App } from "../../src/app";
import { ScanRun } from "../../src/pages/scan/scan_run";
import type { SetUp } from "../../src/pages/scan/set_up";

type Scan = Schemas["ScanDto"];

const job = (id: string, state: string) =>
  ({ id, state, input: { kind: "scan", source: { kind: "station" } } }) as unknown as Job;
const partial = (job_id: string) => ({ id: `of ${job_id}`, job_id, state: "partial" }) as unknown as Scan;

/** A page whose searches are answered by the list, in order; the last answer is repeated. */
function followed(...answers: (Scan[] | Error)[]) {
  const jobs = signal<Job[]>([]);
  let n_searches = 0;
  const GET = async () => {
    const answer = answers[Math.min(n_searches, answers.length - 1)] ?? [];
    n_searches += 1;
    if (answer instanceof Error) throw answer;
    return { data: { items: answer }, response: { ok: true } };
  };
  const station = { status: computed(() => undefined) };
  const run = new ScanRun({ jobs: { list: jobs }, station, api: { GET } } as unknown as App, {} as SetUp);
  return { jobs, run, end: run.follow(), n_searches: () => n_searches };
}

beforeEach(() => {
  vi.useFakeTimers();
});
afterEach(() => {
  vi.useRealTimers();
});

test("the partial scan of an interrupted job is found although the first searches fail", async () => {
  const refused = new TypeError("Failed to fetch");
  const { jobs, run, end, n_searches } = followed(refused, refused, [partial("b"), partial("a")]);
  jobs.value = [job("a", "running")];
  expect(n_searches()).toBe(0);
  jobs.value = [job("a", "interrupted")];
  await vi.advanceTimersByTimeAsync(500);
  expect([n_searches(), run.partial.value]).toEqual([1, undefined]);
  await vi.advanceTimersByTimeAsync(5000);
  expect([n_searches(), run.partial.value?.id]).toEqual([3, "of a"]);
  end();
});

test("a page that is left, or a newer job, ends the search", async () => {
  const { jobs, run, end, n_searches } = followed(new TypeError("Failed to fetch"));
  jobs.value = [job("a", "interrupted")];
  await vi.advanceTimersByTimeAsync(500);
  jobs.value = [job("b", "running"), job("a", "interrupted")];
  await vi.advanceTimersByTimeAsync(5000);
  expect(n_searches()).toBe(1);
  jobs.value = [job("b", "interrupted")];
  await vi.advanceTimersByTimeAsync(500);
  expect(n_searches()).toBe(2);
  end();
  await vi.advanceTimersByTimeAsync(5000);
  expect([n_searches(), run.scan.value]).toEqual([2, undefined]);
});

test("the scan of an earlier job is not shown for the next one", async () => {
  const { jobs, run, end } = followed([partial("a")], new TypeError("Failed to fetch"));
  jobs.value = [job("a", "interrupted")];
  await vi.advanceTimersByTimeAsync(0);
  expect(run.partial.value?.id).toBe("of a");
  jobs.value = [job("b", "failed"), job("a", "interrupted")];
  expect(run.partial.value).toBeUndefined();
  end();
});
