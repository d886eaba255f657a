/** Teaching on a scan, with a server whose answers are given by the test. */

import { expect, vi } from "vitest";
import type { App } from "../../../src/app";
import type { Scan } from "../../../src/pages/result/scan_record";
import { EMPTY_PLAN, type Plan } from "../../../src/pages/teach/draft";
import { TeachState } from "../../../src/pages/teach/teach_state";

export interface Call {
  path: string;
  body: { plan: Plan; tool?: string; region_mm?: number[] };
  signal: AbortSignal | undefined;
  answer: (body: unknown) => void;
  refuse: (detail: string) => void;
}

/** A server whose answers are given by the test. */
export function server() {
  const calls: Call[] = [];
  const request = (path: string, { body, signal }: { body?: Call["body"]; signal?: AbortSignal }) =>
    new Promise((resolve, reject) => {
      const reply = (status: number, part: object) =>
        resolve({ response: new Response(null, { status }), ...part });
      signal?.addEventListener("abort", () => reject(new DOMException("aborted", "AbortError")));
      calls.push({
        path: path.split("/").at(-1) ?? "",
        body: body ?? { plan: EMPTY_PLAN },
        signal,
        answer: (data) => reply(200, { data }),
        refuse: (detail) => reply(422, { error: { title: "Impossible", detail } }),
      });
    });
  const last = async (n: number): Promise<Call> => {
    await vi.waitFor(() => expect(calls).toHaveLength(n));
    return calls[n - 1] as Call;
  };
  return { api: { GET: request, POST: request }, calls, last };
}

/** How the scan was made on which is taught. */
export const RUN = { from_mm: -12, to_mm: 12, step_mm: 0.4, mode: "stop_and_go", exposures_us: [] };

export function taught(api: object) {
  const scan = { id: "s", cloud: "/cloud", plan: RUN } as unknown as Scan;
  const state = new TeachState({ api } as unknown as App, scan, undefined);
  return { state, end: state.follow() };
}
