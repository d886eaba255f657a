/** Hold and resume of the inspection queue, and the reason of a hold. */

import { beforeEach, expect, test, vi } from "vitest";
import { makeApi } from "../../../src/api/client";
import { QueueCommands } from "../../../src/pages/operate/inspect/queue_commands";

const HOLD = "/api/v1/inspection-queue/hold";
const RESUME = "/api/v1/inspection-queue/resume";

let requests: { path: string; body: string }[];
let status: number;
let n_reloads: number;

beforeEach(() => {
  [requests, status, n_reloads] = [[], 200, 0];
  vi.stubGlobal("location", { origin: "http://station", hash: "" });
  vi.stubGlobal("fetch", async (request: Request) => {
    requests.push({ path: new URL(request.url).pathname, body: await request.text() });
    const body = status === 200 ? { held: true, n_waiting: 0 } : { title: "Busy", detail: "Ben is in control" };
    return new Response(JSON.stringify(body), { status, headers: { "content-type": "application/json" } });
  });
});

const commands = () =>
  new QueueCommands(
    makeApi(
      () => undefined,
      () => "Anna",
    ),
    async () => {
      n_reloads += 1;
    },
  );

test("a hold needs no reason; one that is stated is sent once", async () => {
  const queue = commands();
  queue.reason.value = "  ";
  await queue.hold.start();
  queue.reason.value = " new fixture ";
  await queue.hold.start();
  expect(queue.reason.value).toBe("");
  await queue.resume.start();
  await queue.hold.start();
  expect(requests).toEqual([
    { path: HOLD, body: "{}" },
    { path: HOLD, body: '{"reason":"new fixture"}' },
    { path: RESUME, body: "" },
    { path: HOLD, body: "{}" },
  ]);
  expect(n_reloads).toBe(4);
});

test("the reason of a refused hold stays for the next attempt", async () => {
  const queue = commands();
  queue.reason.value = "new fixture";
  status = 409;
  expect(await queue.hold.start()).toBe(false);
  expect([queue.reason.value, queue.hold.problem.value?.detail]).toEqual(["new fixture", "Ben is in control"]);
  status = 200;
  expect(await queue.hold.start()).toBe(true);
  expect(requests.map(({ body }) => body)).toEqual(Array(2).fill('{"reason":"new fixture"}'));
});
