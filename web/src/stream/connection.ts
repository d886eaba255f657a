/**
 * The one WebSocket of the page: it keeps the wishes of all parts, connects again by itself, and knows how old it is.
 *
 * Parts call `want` with what they wish and a listener; the connection asks the server for the fastest rate and the
 * finest scale anybody wants, and forgets a stream when its last listener has gone.
 */

import { signal } from "@preact/signals";
import { type BinaryMessage, decode } from "./protocol";
import type { ClientText, DropCount, ServerText, StreamName, Subscription } from "./texts";

/** The page asks the server so often whether it is there; the answer also tells the age of frames. */
const PING_EVERY_MS = 500;

/** First pause before connecting again; it doubles up to `LONGEST_PAUSE_MS`. */
const FIRST_PAUSE_MS = 250;
const LONGEST_PAUSE_MS = 2000;

/** A connection from which nothing was heard for so long is given up, as the server does with us. */
const SILENCE_MS = 5000;

type Listener = (message: BinaryMessage | ServerText) => void;

interface Wish {
  wanted: Subscription;
  listener: Listener;
}

export class StreamConnection {
  /** Whether the socket is open. */
  readonly connected = signal(false);
  /** When the server was last heard, by `performance.now()`. */
  heard_at_ms = performance.now();
  /** What this viewer missed, by stream. */
  readonly dropped = signal<readonly DropCount[]>([]);
  /** Time from this page to the server and back, ms. */
  readonly round_trip_ms = signal<number | undefined>(undefined);
  /** The software version the server said. */
  readonly server_version = signal("");
  /** Station's clock minus this page's clock, ms; undefined before the first frame. */
  private clock_offset_ms: number | undefined;
  private readonly wishes = new Set<Wish>();
  private readonly reconnected = new Set<() => void>();
  private socket: WebSocket | undefined;
  private pause_ms = FIRST_PAUSE_MS;
  private pings = new Map<number, number>();
  private next_ping = 1;

  constructor(private readonly url: string) {}

  /** Connects, and stays connected for as long as the page lives. */
  start(): void {
    this.connect();
    setInterval(() => this.ask(), PING_EVERY_MS);
  }

  /** Wishes for a stream; the returned function ends the wish. */
  want(wanted: Subscription, listener: Listener): () => void {
    const wish = { wanted, listener };
    this.wishes.add(wish);
    this.subscribe(wanted.stream);
    return () => {
      this.wishes.delete(wish);
      this.subscribe(wanted.stream);
    };
  }

  /** Calls back after each new connection, for those who must catch up over HTTP. */
  onReconnect(callback: () => void): () => void {
    this.reconnected.add(callback);
    return () => this.reconnected.delete(callback);
  }

  /** How old something captured at `captured_ms` of the station's clock is now; undefined while unknown. */
  ageOf(captured_ms: number): number | undefined {
    if (this.clock_offset_ms === undefined) return undefined;
    return performance.now() + this.clock_offset_ms - captured_ms;
  }

  private connect(): void {
    const socket = new WebSocket(this.url, "sheaf.v1");
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => this.opened();
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = () => this.closed(socket);
  }

  private opened(): void {
    this.pause_ms = FIRST_PAUSE_MS;
    this.pings.clear();
    this.connected.value = true;
    this.heard_at_ms = performance.now();
    const streams = new Set([...this.wishes].map((wish) => wish.wanted.stream));
    const wanted = [...streams].flatMap((stream) => this.merged(stream) ?? []);
    if (wanted.length > 0) this.say({ op: "subscribe", streams: wanted });
    for (const callback of this.reconnected) callback();
  }

  private closed(socket: WebSocket): void {
    if (socket !== this.socket) return;
    this.socket = undefined;
    this.connected.value = false;
    setTimeout(() => this.connect(), this.pause_ms);
    this.pause_ms = Math.min(2 * this.pause_ms, LONGEST_PAUSE_MS);
  }

  private receive(message: ArrayBuffer | string): void {
    this.heard_at_ms = performance.now();
    if (typeof message === "string") {
      this.receiveText(JSON.parse(message) as ServerText);
      return;
    }
    const decoded = decode(message);
    if (decoded) this.tell(decoded.kind, decoded);
  }

  private receiveText(text: ServerText): void {
    switch (text.op) {
      case "hello":
        this.server_version.value = text.software_version;
        return;
      case "pong":
        this.synchronise(text.id, text.clock_ms);
        return;
      case "state":
        this.tell("state", text);
        return;
      case "job":
        this.tell("jobs", text);
        return;
      case "event":
        this.tell("events", text);
        return;
      case "scan":
        this.tell("points", text);
        return;
      case "dropped":
        this.dropped.value = text.streams;
        return;
      case "error":
        console.error(`the server refused a message of this page: ${text.detail}`);
        return;
    }
  }

  private tell(stream: StreamName, message: BinaryMessage | ServerText): void {
    for (const wish of this.wishes) if (wish.wanted.stream === stream) wish.listener(message);
  }

  private ask(): void {
    const now = performance.now();
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    if (now - this.heard_at_ms > SILENCE_MS) {
      // A dead cable closes nothing by itself.
      const silent = this.socket;
      silent.close();
      this.closed(silent);
      return;
    }
    const id = this.next_ping++;
    this.pings.set(id, now);
    this.say({ op: "ping", id });
  }

  private synchronise(id: number | undefined, clock_ms: number | null): void {
    const asked_at = id === undefined ? undefined : this.pings.get(id);
    if (id !== undefined) this.pings.delete(id);
    if (asked_at === undefined) return;
    this.round_trip_ms.value = performance.now() - asked_at;
    if (clock_ms === null) return;
    this.clock_offset_ms = clock_ms - (asked_at + performance.now()) / 2;
  }

  private subscribe(stream: StreamName): void {
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    const wanted = this.merged(stream);
    if (wanted) this.say({ op: "subscribe", streams: [wanted] });
    else this.say({ op: "unsubscribe", streams: [stream] });
  }

  /** What all wishes for a stream come to. */
  private merged(stream: StreamName): Subscription | undefined {
    const wanted = [...this.wishes].map((wish) => wish.wanted).filter((wanted) => wanted.stream === stream);
    const last = wanted.at(-1);
    if (!last) return undefined;
    const rates = wanted.map((one) => one.max_rate_hz ?? 30);
    const scales = wanted.map((one) => one.scale ?? 1);
    const merged: Subscription = { stream };
    if (stream !== "points" && stream !== "events") merged.max_rate_hz = Math.max(...rates);
    if (stream === "image") merged.scale = Math.min(...scales) as 1 | 2 | 4;
    if (last.from_block !== undefined) merged.from_block = last.from_block;
    return merged;
  }

  private say(text: ClientText): void {
    this.socket?.send(JSON.stringify(text));
  }
}
