/** Stop goes on until it is known what became of it. The network is a fake here; `browser/stop.test.ts` has real ones. */

import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { signal } from "@preact/signals";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Station } from "../../src/api/client";
import { Stop } from "../../src/state/station/stop";
import type { StopAnswer } from "../../src/stream/connection";

/** A server that answers only when it is told to. */
class Server {
  readonly posts: { abort: AbortSignal; answer: (told: Partial<StopAnswer>) => void; fail: () => void }[] = [];
  n_said = 0;
  readonly status = signal<Station | undefined>({ state: "Operational.SingleExecution" } as Station);
  answerOverSocket: (answer: StopAnswer) => void = () => undefined;
  reconnect: () => void = () => undefined;

  readonly stop = new Stop(
    {
      stop: () => {
        this.n_said += 1;
      },
      onStopped: (callback) => {
        this.answerOverSocket = callback;
        return () => {
          this.answerOverSocket = () => undefined;
        };
      },
      onReconnect: (callback) => {
        this.reconnect = callback;
        return () => {
          this.reconnect = () => undefined;
        };
      },
    },
    { status: this.status },
    (abort) =>
      new Promise((answer, failed) => {
        this.posts.push({ abort, answer, fail: () => failed(new TypeError("unreachable")) });
      }),
    () => "Anna",
  );

  tellState(state: string): void {
    this.status.value = { state } as Station;
  }

  get outcome(): string {
    return this.stop.outcome.value;
  }
}

const HALTED: StopAnswer = { acknowledged: true, state: "Halted", detail: null };

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

/** Lets time pass, and looks that nothing more is sent. */
async function expectSilence(server: Server): Promise<void> {
  const [n_said, n_posts] = [server.n_said, server.posts.length];
  await vi.advanceTimersByTimeAsync(60_000);
  expect([server.n_said, server.posts.length]).toEqual([n_said, n_posts]);
  expect(server.outcome).toBe("none");
}

test("a finger on Stop says it over the socket and by a request in the same moment", () => {
  const server = new Server();
  server.stop.press();
  expect([server.n_said, server.posts.length]).toEqual([1, 1]);
});

test("without an answer it is said again and again, and no attempt is cut short", async () => {
  const server = new Server();
  server.stop.press();
  await vi.advanceTimersByTimeAsync(5000);
  expect(server.n_said).toBe(11);
  expect(server.posts).toHaveLength(11);
  expect(server.posts.map(({ abort }) => abort.aborted)).not.toContain(true);
});

test("a Stop without response changes the message after a while, and nothing else", async () => {
  const server = new Server();
  server.stop.press();
  await vi.advanceTimersByTimeAsync(1400);
  expect(server.outcome).toBe("stopping");
  await vi.advanceTimersByTimeAsync(200);
  expect(server.outcome).toBe("no_response");
  expect(server.posts[0]?.abort.aborted).toBe(false);
});

test("requests that fail at once do not end it", async () => {
  const server = new Server();
  server.stop.press();
  for (let second = 0; second < 10; second++) {
    for (const { fail } of server.posts) fail();
    await vi.advanceTimersByTimeAsync(1000);
  }
  expect(server.n_said).toBe(21);
  expect(server.outcome).toBe("no_response");
});

test("dead connections do not hold up new attempts for ever: of many that hang the oldest goes", async () => {
  const server = new Server();
  server.stop.press();
  await vi.advanceTimersByTimeAsync(60_000);
  expect(server.posts).toHaveLength(121);
  const under_way = server.posts.filter(({ abort }) => !abort.aborted);
  expect(under_way).toEqual(server.posts.slice(-20));
});

test.each<[string, (server: Server) => void]>([
  ["the socket's answer", (server) => server.answerOverSocket(HALTED)],
  ["a request's answer", (server) => server.posts[1]?.answer(HALTED)],
  ["the station's state", (server) => server.tellState("Halted")],
])("it ends by %s, and nothing that still hangs arrives later", async (_, answer) => {
  const server = new Server();
  server.stop.press();
  await vi.advanceTimersByTimeAsync(2000);
  expect(server.outcome).toBe("no_response");
  answer(server);
  await vi.advanceTimersByTimeAsync(0);
  // What was answered is over; the rest must not stop a station that has been reset meanwhile.
  const hanging = server.posts.filter((_, at) => at !== 1);
  expect(hanging.map(({ abort }) => abort.aborted)).not.toContain(false);
  await expectSilence(server);
});

test("what the station said before is no answer: a halted station is stopped again", async () => {
  const server = new Server();
  server.tellState("Halted");
  server.stop.press();
  await vi.advanceTimersByTimeAsync(700);
  expect(server.n_said).toBe(2);
  server.tellState("Halted");
  await expectSilence(server);
});

test("another state than Halted does not end it", async () => {
  const server = new Server();
  server.stop.press();
  server.tellState("Operational.Ready");
  await vi.advanceTimersByTimeAsync(1000);
  expect(server.n_said).toBe(3);
  expect(server.outcome).toBe("stopping");
});

test("devices that did not acknowledge are stopped again until they do", async () => {
  const server = new Server();
  server.stop.press();
  server.answerOverSocket({ acknowledged: false, state: "Halted", detail: "the stage does not answer" });
  server.tellState("Halted");
  await vi.advanceTimersByTimeAsync(3000);
  expect(server.outcome).toBe("unacknowledged");
  expect(server.n_said).toBe(7);
  server.answerOverSocket(HALTED);
  await expectSilence(server);
});

test("a reset by a person is not undone by a Stop that the devices never acknowledged", async () => {
  const server = new Server();
  server.stop.press();
  server.answerOverSocket({ acknowledged: false, state: "Halted", detail: null });
  server.tellState("Halted");
  server.tellState("Operational.Ready");
  await expectSilence(server);
});

test("a new connection carries it at once", () => {
  const server = new Server();
  server.stop.press();
  server.reconnect();
  expect(server.n_said).toBe(2);
});

/** All sources of the page. */
function sources(folder: string): string[] {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    return entry.isDirectory() ? sources(path) : /\.tsx?$/.test(path) ? [path] : [];
  });
}

test("no timeout guards any request of the page", () => {
  const guarded = sources(join(import.meta.dirname, "../../src")).filter((path) =>
    readFileSync(path, "utf8").includes("AbortSignal.timeout"),
  );
  expect(guarded).toEqual([]);
});
