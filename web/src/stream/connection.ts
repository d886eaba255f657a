/**
 * The WebSocket of the page: holds all subscriptions, reconnects automatically, and tracks the time of the last
 * message.
 *
 * Components call `subscribe` with a stream and a listener; the connection requests the highest rate and the finest
 * scale of all subscribers, and unsubscribes when the last one is removed.
 */

import { signal } from "@preact/signals";
import { type BinaryMessage, decode } from "./protocol";
import {
  type ClientText,
  type DropCount,
  isServerText,
  type ServerText,
  type StreamName,
  type Subscription,
} from "./text_messages";

/** Ping interval; the reply also gives the age of frames. */
const PING_EVERY_MS = 500;

/** First pause before reconnecting; it doubles up to `LONGEST_PAUSE_MS`. */
const FIRST_PAUSE_MS = 250;
const LONGEST_PAUSE_MS = 2000;

/** Retry interval of a hidden page: many open tabs must not overload a restarted server. */
const HIDDEN_PAUSE_MS = 30_000;

/** Relative jitter of the pauses, so that pages do not all reconnect to a restarted server at once. */
const PAUSE_SPREAD = 0.3;

/** Timeout of a connection attempt. */
const CONNECT_WITHIN_MS = 10_000;

/** A connection is closed if a ping is not answered within this time; the server does the same. */
const SILENCE_MS = 5000;

/** Subscribing to these streams counts as viewing, which keeps the live laser on: a hidden page unsubscribes. */
const VIEWER_STREAMS: readonly StreamName[] = ["image", "profile"];

/** Image scales, the finest first. */
const SCALES = [1, 2, 4] as const;

type Listener = (message: BinaryMessage | ServerText) => void;

/** The response to a `stop`. */
export type StopAnswer = Omit<Extract<ServerText, { op: "stopped" }>, "op" | "id">;

interface Subscriber {
  wanted: Subscription;
  listener: Listener;
}

export class StreamConnection {
  /** Whether the socket is open. */
  readonly connected = signal(false);
  /** Time of the last message from the server, by `performance.now()`. */
  last_message_at_ms = performance.now();
  /** Messages not sent to this page, by stream. */
  readonly dropped = signal<readonly DropCount[]>([]);
  /** Round-trip time to the server, ms. */
  readonly round_trip_ms = signal<number | undefined>(undefined);
  /** The software version reported by the server. */
  readonly server_version = signal("");
  /** The version of a server that was updated since this page was loaded. */
  readonly updated_to = signal<string | undefined>(undefined);
  /** Station's clock minus this page's clock, ms; undefined before the first frame. */
  private clock_offset_ms: number | undefined;
  private readonly subscribers = new Set<Subscriber>();
  private readonly reconnected = new Set<() => void>();
  private readonly stopped = new Set<(answer: StopAnswer) => void>();
  private socket: WebSocket | undefined;
  private visible = true;
  private pause_ms = FIRST_PAUSE_MS;
  private retry: ReturnType<typeof setTimeout> | undefined;
  private attempt: ReturnType<typeof setTimeout> | undefined;
  /** Time of the oldest ping without any later message. */
  private unanswered_since_ms: number | undefined;
  /** The first version reported. */
  private initial_version: string | undefined;
  private pings = new Map<number, number>();
  private next_ping = 1;

  constructor(private readonly url: string) {}

  /** Connects, and reconnects for the lifetime of the page. */
  start(): void {
    this.connect();
    setInterval(() => this.ping(), PING_EVERY_MS);
  }

  /** Subscribes to a stream; the returned function ends the subscription. */
  subscribe(wanted: Subscription, listener: Listener): () => void {
    const subscriber = { wanted, listener };
    this.subscribers.add(subscriber);
    this.sendSubscription(wanted.stream);
    return () => {
      this.subscribers.delete(subscriber);
      this.sendSubscription(wanted.stream);
    };
  }

  /** Calls back after each new connection, for those who must catch up over HTTP. */
  onReconnect(callback: () => void): () => void {
    this.reconnected.add(callback);
    return () => this.reconnected.delete(callback);
  }

  /** Age of something captured at `captured_ms` of the station's clock; undefined while the clock offset is unknown. */
  ageOf(captured_ms: number): number | undefined {
    if (this.clock_offset_ms === undefined) return undefined;
    return performance.now() + this.clock_offset_ms - captured_ms;
  }

  /** Calls back with each answer to a `stop`. */
  onStopped(callback: (answer: StopAnswer) => void): () => void {
    this.stopped.add(callback);
    return () => this.stopped.delete(callback);
  }

  /** Requests Stop over the open connection; without one nothing is sent. */
  stop(actor: string): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.send({ op: "stop", actor });
  }

  /** Whether the page is visible; a hidden page subscribes to neither images nor profiles. */
  setVisible(visible: boolean): void {
    if (visible === this.visible) return;
    this.visible = visible;
    for (const stream of VIEWER_STREAMS) {
      if ([...this.subscribers].some((subscriber) => subscriber.wanted.stream === stream))
        this.sendSubscription(stream);
    }
    if (visible && this.retry !== undefined) this.connect();
  }

  private connect(): void {
    clearTimeout(this.retry);
    this.retry = undefined;
    const socket = new WebSocket(this.url, "sheaf.v1");
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.attempt = setTimeout(() => this.abandon(socket), CONNECT_WITHIN_MS);
    socket.onopen = () => this.opened(socket);
    socket.onmessage = (event) => {
      if (socket === this.socket) this.receive(event.data);
    };
    socket.onclose = () => this.closed(socket);
  }

  private opened(socket: WebSocket): void {
    if (socket !== this.socket) return;
    clearTimeout(this.attempt);
    this.pause_ms = FIRST_PAUSE_MS;
    this.unanswered_since_ms = undefined;
    this.pings.clear();
    this.connected.value = true;
    this.last_message_at_ms = performance.now();
    const streams = new Set([...this.subscribers].map((subscriber) => subscriber.wanted.stream));
    const wanted = [...streams].flatMap((stream) => this.merged(stream) ?? []);
    if (wanted.length > 0) this.send({ op: "subscribe", streams: wanted });
    for (const callback of this.reconnected) callback();
  }

  /** A disconnected cable does not close the socket. */
  private abandon(socket: WebSocket): void {
    socket.close();
    this.closed(socket);
  }

  private closed(socket: WebSocket): void {
    if (socket !== this.socket) return;
    clearTimeout(this.attempt);
    this.socket = undefined;
    this.connected.value = false;
    const pause_ms = this.visible ? this.pause_ms : HIDDEN_PAUSE_MS;
    this.retry = setTimeout(() => this.connect(), pause_ms * (1 + PAUSE_SPREAD * Math.random()));
    this.pause_ms = Math.min(2 * this.pause_ms, LONGEST_PAUSE_MS);
  }

  private receive(message: ArrayBuffer | string): void {
    this.last_message_at_ms = performance.now();
    this.unanswered_since_ms = undefined;
    if (typeof message === "string") {
      const text: unknown = JSON.parse(message);
      if (isServerText(text)) this.receiveText(text);
      return;
    }
    const decoded = decode(message);
    if (decoded) this.dispatch(decoded.kind, decoded);
  }

  private receiveText(text: ServerText): void {
    switch (text.op) {
      case "hello":
        this.initial_version ??= text.software_version;
        this.updated_to.value = this.initial_version === text.software_version ? undefined : text.software_version;
        this.server_version.value = text.software_version;
        return;
      case "pong":
        this.synchronise(text.id, text.clock_ms);
        return;
      case "state":
        this.dispatch("state", text);
        return;
      case "job":
        this.dispatch("jobs", text);
        return;
      case "event":
        this.dispatch("events", text);
        return;
      case "scan":
        this.dispatch("points", text);
        return;
      case "dropped":
        this.dropped.value = text.streams;
        return;
      case "stopped":
        for (const callback of this.stopped) callback(text);
        return;
      case "error":
        console.error(`the server refused a message of this page: ${text.detail}`);
        return;
    }
  }

  private dispatch(stream: StreamName, message: BinaryMessage | ServerText): void {
    for (const subscriber of this.subscribers)
      if (subscriber.wanted.stream === stream) subscriber.listener(message);
  }

  private ping(): void {
    const now = performance.now();
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    // Browsers throttle timers of hidden pages to one a minute: measure silence from an unanswered ping.
    if (this.unanswered_since_ms !== undefined && now - this.unanswered_since_ms > SILENCE_MS) {
      this.abandon(this.socket);
      return;
    }
    this.unanswered_since_ms ??= now;
    const id = this.next_ping++;
    this.pings.set(id, now);
    this.send({ op: "ping", id });
  }

  private synchronise(id: number | undefined, clock_ms: number | null): void {
    const sent_at_ms = id === undefined ? undefined : this.pings.get(id);
    if (id !== undefined) this.pings.delete(id);
    if (sent_at_ms === undefined) return;
    this.round_trip_ms.value = performance.now() - sent_at_ms;
    if (clock_ms === null) return;
    this.clock_offset_ms = clock_ms - (sent_at_ms + performance.now()) / 2;
  }

  private sendSubscription(stream: StreamName): void {
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    const wanted = this.merged(stream);
    if (wanted) this.send({ op: "subscribe", streams: [wanted] });
    else this.send({ op: "unsubscribe", streams: [stream] });
  }

  /** The merged subscriptions of a stream; undefined if there are none, or the page is hidden. */
  private merged(stream: StreamName): Subscription | undefined {
    if (!this.visible && VIEWER_STREAMS.includes(stream)) return undefined;
    const wanted = [...this.subscribers]
      .map((subscriber) => subscriber.wanted)
      .filter((wanted) => wanted.stream === stream);
    const last = wanted.at(-1);
    if (!last) return undefined;
    const rates = wanted.map((one) => one.max_rate_hz ?? 30);
    const scales = wanted.map((one) => one.scale ?? 1);
    const merged: Subscription = { stream };
    if (stream !== "points" && stream !== "events") merged.max_rate_hz = Math.max(...rates);
    if (stream === "image") merged.scale = SCALES.find((scale) => scales.includes(scale)) ?? 1;
    if (last.from_block !== undefined) merged.from_block = last.from_block;
    return merged;
  }

  private send(text: ClientText): void {
    this.socket?.send(JSON.stringify(text));
  }
}
