/** Who commands, and how this page learns that it does so no longer. */

import { signal } from "@preact/signals";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { type Api, makeApi } from "../../src/api/client";
import { Control } from "../../src/state/station/control";
import type { StationState } from "../../src/state/station/station";

interface Asked {
  method: string;
  path: string;
  control: string | null;
}

let asked: Asked[];
let answer: (asked: Asked) => { status: number; body?: unknown };

const LEASE = { id: "lease-1", holder: "Anna", expires_in_s: 5 };
const problem = (kind: string) => ({
  status: 409,
  body: { type: `urn:sheaf:problem:${kind}`, title: kind, status: 409, detail: kind },
});

beforeEach(() => {
  vi.useFakeTimers();
  asked = [];
  answer = () => ({ status: 200, body: LEASE });
  vi.stubGlobal("location", { origin: "http://station", hash: "" });
  vi.stubGlobal("document", { addEventListener: () => undefined });
  vi.stubGlobal("addEventListener", () => undefined);
  vi.stubGlobal("fetch", async (request: Request) => {
    const one = {
      method: request.method,
      path: new URL(request.url).pathname,
      control: request.headers.get("Sheaf-Control"),
    };
    asked.push(one);
    const { status, body } = answer(one);
    return new Response(JSON.stringify(body), { status, headers: { "content-type": "application/json" } });
  });
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

function made(): { control: Control; api: Api } {
  const station = { status: signal(undefined) } as unknown as StationState;
  const control: Control = new Control(station, () => api);
  const api = makeApi(
    () => control.id(),
    () => control.name,
  );
  control.start();
  return { control, api };
}

async function afterRenewal(kind: string, holder?: string): Promise<Control> {
  const { control } = made();
  await control.take();
  answer = ({ method }) =>
    method === "GET" ? (holder ? { status: 200, body: { holder } } : { status: 404 }) : problem(kind);
  await vi.advanceTimersByTimeAsync(1600);
  return control;
}

test("control that ran out because nothing was commanded is not called taken", async () => {
  const control = await afterRenewal("control-expired");
  expect(control.mine.value).toBe(false);
  expect(control.lost.value).toEqual({ kind: "idle" });
});

test("control that ran out because the page slept is called so", async () => {
  const { control } = made();
  await control.take();
  answer = () => problem("control-expired");
  const now = performance.now();
  vi.spyOn(performance, "now").mockReturnValue(now + 60_000);
  await vi.advanceTimersByTimeAsync(1600);
  expect(control.lost.value).toEqual({ kind: "not_renewed" });
  vi.restoreAllMocks();
});

test("control that lapses is idle also when its last renewal was for a moment only", async () => {
  const { control } = made();
  await control.take();
  answer = () => ({ status: 200, body: { ...LEASE, expires_in_s: 0.2 } });
  await vi.advanceTimersByTimeAsync(1600);
  answer = () => problem("control-expired");
  await vi.advanceTimersByTimeAsync(1600);
  expect(control.lost.value).toEqual({ kind: "idle" });
});

test("control that a server forgot was not taken by somebody", async () => {
  const control = await afterRenewal("control-required");
  expect(control.lost.value).toEqual({ kind: "not_renewed" });
});

test("control that somebody took is reported with the name", async () => {
  const control = await afterRenewal("control-required", "Ben");
  expect(control.mine.value).toBe(false);
  expect(control.lost.value).toEqual({ kind: "taken", by: "Ben" });
});

test("a busy server does not take control away", async () => {
  const { control } = made();
  await control.take();
  answer = () => ({ status: 429, body: { type: "urn:sheaf:problem:too-many", detail: "later", status: 429 } });
  await vi.advanceTimersByTimeAsync(3200);
  expect(control.mine.value).toBe(true);
  expect(control.lost.value).toBeUndefined();
});

test("with control every request that changes something carries the lease, jobs and cancels too", async () => {
  const { control, api } = made();
  const post = async () => {
    asked = [];
    await api.POST("/api/v1/scans", { body: { source: { kind: "station" } } });
    await api.POST("/api/v1/jobs/{id}/cancel", { params: { path: { id: "job" } } });
    await api.POST("/api/v1/calibration-sessions/{id}/poses", {
      params: { path: { id: "session" }, header: { "If-Match": "1" } as never },
      body: {} as never,
    });
    return asked.map(({ control }) => control);
  };
  expect(await post()).toEqual([null, null, null]);
  await control.take();
  expect(await post()).toEqual(["lease-1", "lease-1", "lease-1"]);
});
