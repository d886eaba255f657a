/** What Operate decides with a recipe: choice, start, repeated serial numbers, stages and the last verdict. */

import { signal } from "@preact/signals";
import { expect, test } from "vitest";
import type { Api, Job } from "../../../src/api/client";
import type { App } from "../../../src/app";
import {
  BY_SERIAL,
  choiceOf,
  SCAN_ONLY,
  storedChoice,
  versionsOf,
} from "../../../src/pages/operate/inspect/choice";
import { InspectionRun } from "../../../src/pages/operate/inspect/inspection_run";
import { lastOf, stageOf } from "../../../src/pages/operate/inspect/last";
import { type Inspection, readNewestParts } from "../../../src/state/records/inspections";
import type { Recipe } from "../../../src/state/records/recipes";

const recipe = (id: string, part: Partial<Recipe> = {}) => ({ id, name: id, version: 3, ...part }) as Recipe;

test("the recipe is the one chosen, else the only one, else that of the serial number", () => {
  const [a, b] = [recipe("a"), recipe("b")];
  const ruled = recipe("c", { serial_pattern: "C.*" });
  const kindOf = (recipes: Recipe[], stored: string) => choiceOf(recipes, stored).kind;
  expect(kindOf([], "a")).toBe("scan_only");
  expect(kindOf([a, b], SCAN_ONLY)).toBe("scan_only");
  expect(choiceOf([a], "")).toEqual({ kind: "recipe", recipe: a, version: undefined });
  expect(kindOf([a, b], "")).toBe("none");
  expect(kindOf([a, ruled], "")).toBe("by_serial");
  expect(choiceOf([a, b], "b@2")).toEqual({ kind: "recipe", recipe: b, version: 2 });
  // A version that does not exist is not guessed.
  for (const unknown of ["b@4", "b@0", "b@x"])
    expect(choiceOf([a, b], unknown), unknown).toEqual({ kind: "recipe", recipe: b, version: undefined });
  // A chosen recipe that was archived is not replaced by another one.
  expect(kindOf([a], "archived")).toBe("none");
  expect(kindOf([a], BY_SERIAL)).toBe("recipe");
  for (const stored of [BY_SERIAL, SCAN_ONLY, "c", "c@2"])
    expect(storedChoice(choiceOf([a, ruled], stored))).toBe(stored);
  expect(versionsOf(b)).toEqual([3, 2, 1]);
  expect(versionsOf(b, 2)).toEqual([3, 2]);
});

const job = (id: string, part: Partial<Job> = {}) =>
  ({ id, kind: "inspection", state: "succeeded", input: { kind: "inspection", serial: "next" }, ...part }) as Job;
const inspection = (id: string, created_at_ms: number, part: Partial<Inspection> = {}) =>
  ({ id, job_id: id, created_at_ms, serial: id, ...part }) as Inspection;

test("the verdict is that of the newest part, and of no earlier one", () => {
  const known = [inspection("a", 10)];
  expect(lastOf([], undefined).kind).toBe("none");
  expect(lastOf(known, undefined)).toEqual({ kind: "inspection", inspection: known[0] });
  expect(lastOf(known, job("a", { ended_at_ms: 10 })).kind).toBe("inspection");
  expect(lastOf(known, job("b", { state: "queued" }))).toEqual({ kind: "waiting", serial: "next" });
  expect(lastOf(known, job("b", { state: "running" }))).toEqual({ kind: "running", serial: "next" });
  // Ended after the last verdict, even if it was requested before.
  for (const state of ["failed", "cancelled", "interrupted"] as const)
    expect(lastOf(known, job("b", { state, created_at_ms: 5, ended_at_ms: 20 })).kind).toBe("without_verdict");
  // Its inspection is being read.
  expect(lastOf(known, job("b", { ended_at_ms: 20 })).kind).toBe("running");
  // Another station interface inspected a part since.
  expect(lastOf([inspection("c", 30), ...known], job("b", { state: "failed", ended_at_ms: 20 })).kind).toBe(
    "inspection",
  );
});

test("an inspection waits, scans, measures", () => {
  const stage = (state: Job["state"], phase?: string) =>
    stageOf({ state, step: phase === undefined ? null : { phase } } as Job);
  expect(stage("queued")).toBe("queued");
  expect(stage("running")).toBe("scanning");
  expect(stage("running", "homing")).toBe("scanning");
  expect(stage("running", "capturing_rows")).toBe("scanning");
  for (const phase of ["computing_cloud", "storing_cloud", "measuring"])
    expect(stage("running", phase), phase).toBe("measuring");
});

test("re-evaluations are not parts: older pages are read until there are enough", async () => {
  const all = Array.from({ length: 100 }, (_, idx) =>
    inspection(`i${idx}`, 1000 - idx, idx % 4 === 0 ? {} : { re_evaluated_from: "earlier" }),
  );
  const api = {
    GET: async (_path: string, { params }: { params: { query: { limit: number; before?: string } } }) => {
      const { limit, before } = params.query;
      const from = before === undefined ? 0 : all.findIndex(({ id }) => id === before) + 1;
      const items = all.slice(from, from + limit);
      const next = from + limit < all.length ? "…" : null;
      return { data: { items, damaged: [], next }, response: new Response() };
    },
  } as unknown as Api;
  const first = await readNewestParts(api, 20);
  expect(first.items.map(({ id }) => id)).toEqual(Array.from({ length: 20 }, (_, idx) => `i${4 * idx}`));
  expect((await readNewestParts(api, 40)).items.length).toBe(25);
});

/** A server with one inspection of "A-1"; requests are recorded. */
function bench(post: () => Promise<unknown>, operator?: string) {
  const requests: { key: string; body: unknown }[] = [];
  const api = {
    GET: async (_path: string, { params }: { params: { query: { serial: string } } }) => {
      const items = params.query.serial === "A-1" ? [inspection("old", 5, { serial: "A-1" })] : [];
      return { data: { items, damaged: [], next: null }, response: new Response() };
    },
    POST: async (
      _path: string,
      { params, body }: { params: { header: Record<string, string> }; body: unknown },
    ) => {
      requests.push({ key: params.header["Idempotency-Key"] ?? "", body });
      return await post();
    },
  };
  const jobs = { list: signal([]), update: () => {}, ended: async () => job("new") };
  const part = { serial: signal(" A-2 "), order: signal("") };
  const app = { api, jobs } as unknown as Pick<App, "api" | "jobs">;
  const run = new InspectionRun(
    app,
    part,
    () => "block@2",
    () => operator,
  );
  return { run, part, requests };
}

const accepted = async () => ({ data: job("new", { state: "queued" }), response: new Response() });

test("Start requests an inspection and frees the field for the next serial number; the order stays", async () => {
  const { run, part, requests } = bench(accepted);
  part.order.value = " 4711 ";
  expect(await run.command.start()).toBe(true);
  expect(requests.map(({ body }) => body)).toEqual([{ serial: "A-2", recipe: "block@2", order: "4711" }]);
  expect([part.serial.value, part.order.value]).toEqual(["", " 4711 "]);
});

test("the name of the person is sent as the operator, also when a part is inspected again", async () => {
  const { run, part, requests } = bench(accepted, "Anna");
  const attributes = { operator: "Anna" };
  await run.command.start();
  part.serial.value = "A-1";
  await run.command.start();
  await run.again.start();
  expect(requests.map(({ body }) => body)).toEqual([
    { serial: "A-2", recipe: "block@2", attributes },
    { serial: "A-1", recipe: "block@2", attributes },
  ]);
});

test("a serial number that was inspected before is asked about first", async () => {
  const { run, part, requests } = bench(accepted);
  part.serial.value = "A-1";
  await run.command.start();
  expect([requests.length, run.repeated.value?.id, part.serial.value]).toEqual([0, "old", "A-1"]);
  await run.again.start();
  expect([requests.length, run.repeated.value, part.serial.value]).toEqual([1, undefined, ""]);
});

test("a lost response is asked for again with the same key; another part has another key", async () => {
  let answer: () => Promise<unknown> = async () => {
    throw new TypeError("Failed to fetch");
  };
  const { run, part, requests } = bench(() => answer());
  expect(await run.command.start()).toBe(false);
  expect([run.command.problem.value?.status, part.serial.value]).toEqual([0, " A-2 "]);
  answer = accepted;
  expect(await run.command.start()).toBe(true);
  part.serial.value = "A-2b";
  await run.command.start();
  const [lost, repeated, other] = requests.map(({ key }) => key);
  expect(repeated).toBe(lost);
  expect(other).not.toBe(lost);
  // Refused by the server: the next attempt is a new request.
  const refusal = { type: "x", title: "Busy", status: 409, detail: "busy" };
  answer = async () => ({ error: refusal, response: new Response(null, { status: 409 }) });
  part.serial.value = "A-3";
  await run.command.start();
  answer = accepted;
  await run.command.start();
  expect(requests.at(-1)?.key).not.toBe(requests.at(-2)?.key);
});
