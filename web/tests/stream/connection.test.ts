/** The page's one WebSocket: attempts end, silence is told from sleep, and nobody is a viewer who does not look. */

import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { StreamConnection } from "../../src/stream/connection";

/** A socket whose other side is the test. */
class FakeSocket {
  static readonly OPEN = 1;
  static made: FakeSocket[] = [];
  static get newest(): FakeSocket {
    return FakeSocket.made.at(-1) as FakeSocket;
  }
  readyState = 0;
  sent: { op: string; streams?: unknown[]; actor?: string }[] = [];
  onopen: () => void = () => undefined;
  onclose: () => void = () => undefined;
  onmessage: (event: { data: string }) => void = () => undefined;

  constructor() {
    FakeSocket.made.push(this);
  }
  open(): void {
    this.readyState = FakeSocket.OPEN;
    this.onopen();
  }
  send(text: string): void {
    this.sent.push(JSON.parse(text));
  }
  close(): void {
    this.readyState = 2;
  }
  hear(text: unknown): void {
    this.onmessage({ data: JSON.stringify(text) });
  }
  of(op: string): unknown[] {
    return this.sent.filter((text) => text.op === op);
  }
}

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", FakeSocket);
  FakeSocket.made = [];
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

function started(): StreamConnection {
  const stream = new StreamConnection("ws://station/api/v1/stream");
  stream.start();
  return stream;
}

test("an attempt to connect that never ends is given up for another", async () => {
  const stream = started();
  await vi.advanceTimersByTimeAsync(11_000);
  expect(FakeSocket.made).toHaveLength(2);
  FakeSocket.newest.open();
  expect(stream.connected.value).toBe(true);
  // The one that was given up says nothing any more.
  FakeSocket.made[0]?.open();
  FakeSocket.made[0]?.onclose();
  expect(stream.connected.value).toBe(true);
});

test("a connection on which pings stay unanswered is given up", async () => {
  const stream = started();
  FakeSocket.newest.open();
  await vi.advanceTimersByTimeAsync(7000);
  expect(stream.connected.value).toBe(false);
  expect(FakeSocket.made).toHaveLength(2);
});

test("a page whose timers sleep keeps its connection: it was not asked, so it did not stay silent", async () => {
  started();
  const socket = FakeSocket.newest;
  socket.open();
  await vi.advanceTimersByTimeAsync(500);
  socket.hear({ op: "pong", id: 1, clock_ms: null });
  const now = performance.now();
  // A minute in which the browser ran no timer of this page.
  vi.spyOn(performance, "now").mockReturnValue(now + 60_000);
  await vi.advanceTimersByTimeAsync(500);
  expect(FakeSocket.made).toHaveLength(1);
  expect(socket.of("ping")).toHaveLength(2);
  vi.restoreAllMocks();
});

test("a hidden page asks for no images and profiles, and for all else; seen again it asks for them", () => {
  const stream = started();
  const socket = FakeSocket.newest;
  socket.open();
  stream.subscribe({ stream: "image", max_rate_hz: 20 }, () => undefined);
  stream.subscribe({ stream: "state", max_rate_hz: 5 }, () => undefined);
  socket.sent = [];
  stream.setVisible(false);
  expect(socket.sent).toEqual([{ op: "unsubscribe", streams: ["image"] }]);
  stream.subscribe({ stream: "profile", max_rate_hz: 20 }, () => undefined);
  expect(socket.of("subscribe")).toEqual([]);
  socket.sent = [];
  stream.setVisible(true);
  expect(socket.sent).toEqual([
    { op: "subscribe", streams: [{ stream: "image", max_rate_hz: 20, scale: 1 }] },
    { op: "subscribe", streams: [{ stream: "profile", max_rate_hz: 20 }] },
  ]);
  expect(FakeSocket.made).toHaveLength(1);
});

test("a connection made while nobody looks is not a viewer's", () => {
  const stream = started();
  stream.subscribe({ stream: "image", max_rate_hz: 20 }, () => undefined);
  stream.subscribe({ stream: "jobs", max_rate_hz: 10 }, () => undefined);
  stream.setVisible(false);
  FakeSocket.newest.open();
  expect(FakeSocket.newest.of("subscribe")).toEqual([
    { op: "subscribe", streams: [{ stream: "jobs", max_rate_hz: 10 }] },
  ]);
});

test("hidden pages come back seldom, and at once when they are seen", async () => {
  const stream = started();
  FakeSocket.newest.open();
  stream.setVisible(false);
  FakeSocket.newest.onclose();
  await vi.advanceTimersByTimeAsync(25_000);
  expect(FakeSocket.made).toHaveLength(1);
  stream.setVisible(true);
  expect(FakeSocket.made).toHaveLength(2);
  await vi.advanceTimersByTimeAsync(5000);
  expect(FakeSocket.made).toHaveLength(2);
});

test("a server of another version than the page's is reported, one of the same is not", () => {
  const stream = started();
  const hello = (software_version: string) =>
    FakeSocket.newest.hear({ op: "hello", protocol: "sheaf.v1", software_version, clock_ms: null });
  FakeSocket.newest.open();
  hello("1.0.0");
  hello("1.0.0");
  expect(stream.updated_to.value).toBeUndefined();
  hello("1.1.0");
  expect(stream.updated_to.value).toBe("1.1.0");
});

test("Stop goes over the open connection with its actor, and its answer is received", () => {
  const stream = started();
  const socket = FakeSocket.newest;
  stream.stop("Anna");
  expect(socket.sent).toEqual([]);
  socket.open();
  stream.stop("Anna");
  expect(socket.of("stop")).toEqual([{ op: "stop", actor: "Anna" }]);
  const heard = vi.fn();
  stream.onStopped(heard);
  socket.hear({ op: "stopped", acknowledged: true, state: "Halted", detail: null });
  expect(heard).toHaveBeenCalledWith(expect.objectContaining({ acknowledged: true, state: "Halted" }));
});
