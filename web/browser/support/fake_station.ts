/**
 * A server that serves the page, reports a chosen state, counts every Stop request, and simulates network failures.
 * It replaces the real server in tests of the connection.
 */

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join, normalize } from "node:path";
import type { Duplex } from "node:stream";

const DIST = join(import.meta.dirname, "../../dist");

const TYPES: Record<string, string> = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".css": "text/css",
  ".svg": "image/svg+xml",
};

/** What RFC 6455 adds to the client's key. */
const WEBSOCKET_KEY = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";

const SETTINGS = { exposure_us: 2000, gain_db: 0, frame_rate_hz: 30 };

const PLAN = {
  duration_s: 12,
  n_rows: 201,
  step_mm: 0.2,
  points_per_mm2: 20,
  max_points: 400_000,
  n_orders: 5,
  predicted_sigma_mm: 0.01,
  depth_mm: [350, 450],
  unambiguous_depth_mm: [380, 420],
  exposure_us: 2000,
  exposures_us: [],
  laser_power: 1,
  disk_bytes: 1e7,
  notes: [],
};

const DEVICES = {
  activity: "idle",
  words: "ready",
  faults: [],
  simulated: null,
  control: null,
  job_id: null,
  camera: {
    connected: true,
    settings: SETTINGS,
    capabilities: {
      exposure_us: { min: 10, max: 100_000 },
      gain_db: { min: 0, max: 24 },
      frame_rate_hz: { min: 1, max: 200 },
    },
  },
  stage: {
    connected: true,
    kind: "linear",
    homed: true,
    needs_homing: true,
    moving: false,
    position_mm: 0,
    travel_mm: [-100, 100],
  },
  laser: { connected: true, light: "off", power: 0, interlock_closed: true },
  frames: { arrived: 0, dropped: {} },
};

const HALTED = { acknowledged: true, state: "Halted", detail: null };

export class FakeStation {
  /** Requests that would change something, but for Stop: what they ask, with which lease. */
  readonly commands: { request: string; body: unknown; control: string | undefined }[] = [];
  /** Texts of all pages, in the order they came, but for pings. */
  readonly texts: { op: string; id?: number; streams?: unknown[] }[] = [];
  n_connections = 0;
  /** The response for any scan. */
  plan: unknown = PLAN;
  /** Which way each Stop came that this server has read. */
  readonly stops: ("post" | "websocket")[] = [];
  state = "Operational.SingleExecution";
  /** Whether requests are accepted and never answered, like a cable cut behind a switch. */
  silent = false;
  private readonly sockets = new Set<Duplex>();
  private readonly server: Server;

  private constructor() {
    this.server = createServer((request, response) => void this.answer(request, response));
    this.server.on("upgrade", (request, socket) => this.upgrade(request, socket));
  }

  static async start(): Promise<FakeStation> {
    const station = new FakeStation();
    await new Promise<void>((listening) => station.server.listen(0, "127.0.0.1", listening));
    return station;
  }

  get url(): string {
    return `http://127.0.0.1:${(this.server.address() as AddressInfo).port}`;
  }

  async end(): Promise<void> {
    for (const socket of this.sockets) socket.destroy();
    this.server.closeAllConnections();
    await new Promise((ended) => this.server.close(ended));
  }

  /** Changes its state and notifies all clients. */
  enter(state: string): void {
    this.state = state;
    for (const socket of this.sockets) this.say(socket, this.stateText());
  }

  /** Answers a request, or leaves it hanging. */
  private async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = new URL(request.url ?? "/", this.url).pathname;
    // A stalled download.
    if (this.silent || path === "/stalled") return;
    const asked = `${request.method} ${path}`;
    if (request.method !== "GET" && !path.endsWith("/stop")) {
      const chunks: Buffer[] = [];
      for await (const chunk of request) chunks.push(chunk as Buffer);
      const body: unknown = JSON.parse(Buffer.concat(chunks).toString() || "null");
      this.commands.push({
        request: asked,
        body,
        control: request.headers["sheaf-control"] as string | undefined,
      });
    }
    if (path.startsWith("/api/")) this.json(response, this.carryOut(asked));
    else this.file(response, path === "/" ? "/index.html" : path);
  }

  private carryOut(request: string): unknown {
    switch (request) {
      case "POST /api/v1/station/stop":
        this.stops.push("post");
        this.enter("Halted");
        return HALTED;
      case "POST /api/v1/station/control":
      case "PUT /api/v1/station/control":
        return { id: "lease", holder: "Test", expires_in_s: 5 };
      case "POST /api/v1/station/reset":
        this.enter("Operational.Ready");
        return this.station();
      case "POST /api/v1/scans/plan":
        return this.plan;
      case "GET /api/v1/devices/camera/settings":
      case "PATCH /api/v1/devices/camera/settings":
        return SETTINGS;
      default:
        return { items: [] };
    }
  }

  private station() {
    return { ...DEVICES, state: this.state };
  }

  private stateText() {
    return { op: "state", changes: [], station: this.station() };
  }

  private json(response: ServerResponse, body: unknown): void {
    response.writeHead(200, { "content-type": "application/json", etag: '"1"' }).end(JSON.stringify(body));
  }

  private file(response: ServerResponse, path: string): void {
    try {
      const bytes = readFileSync(join(DIST, normalize(path)));
      response.writeHead(200, { "content-type": TYPES[extname(path)] ?? "application/octet-stream" }).end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  }

  private upgrade(request: IncomingMessage, socket: Duplex): void {
    socket.on("error", () => undefined);
    if (this.silent) return;
    const key = createHash("sha1").update(`${request.headers["sec-websocket-key"]}${WEBSOCKET_KEY}`);
    const head = [
      "HTTP/1.1 101 Switching Protocols",
      "Upgrade: websocket",
      "Connection: Upgrade",
      `Sec-WebSocket-Accept: ${key.digest("base64")}`,
      "Sec-WebSocket-Protocol: sheaf.v1",
    ];
    socket.write(`${head.join("\r\n")}\r\n\r\n`);
    this.sockets.add(socket);
    this.n_connections += 1;
    socket.on("close", () => this.sockets.delete(socket));
    this.say(socket, { op: "hello", protocol: "sheaf.v1", software_version: "0.0.0", clock_ms: null });
    let unread = Buffer.alloc(0);
    socket.on("data", (bytes: Buffer) => {
      unread = Buffer.concat([unread, bytes]);
      for (let frame = readFrame(unread); frame; frame = readFrame(unread)) {
        unread = unread.subarray(frame.size_bytes);
        if (frame.opcode === 1 && !this.silent) this.hear(socket, JSON.parse(frame.text));
        if (frame.opcode === 8) socket.end();
      }
    });
  }

  private hear(socket: Duplex, text: FakeStation["texts"][number]): void {
    if (text.op !== "ping") this.texts.push(text);
    if (text.op === "ping") this.say(socket, { op: "pong", id: text.id, clock_ms: null });
    if (text.op === "subscribe") this.say(socket, this.stateText());
    if (text.op !== "stop") return;
    this.stops.push("websocket");
    this.enter("Halted");
    this.say(socket, { op: "stopped", ...HALTED });
  }

  private say(socket: Duplex, text: unknown): void {
    if (this.silent) return;
    const payload = Buffer.from(JSON.stringify(text));
    const long = payload.length > 125;
    const head = Buffer.alloc(long ? 4 : 2);
    head[0] = 0x81;
    head[1] = long ? 126 : payload.length;
    if (long) head.writeUInt16BE(payload.length, 2);
    socket.write(Buffer.concat([head, payload]));
  }
}

/** The first frame of a browser's bytes, which are masked; `undefined` while it is not all there. */
function readFrame(bytes: Buffer): { opcode: number; text: string; size_bytes: number } | undefined {
  if (bytes.length < 6) return undefined;
  const long = ((bytes[1] ?? 0) & 0x7f) === 126;
  const begin = long ? 8 : 6;
  const length = long ? bytes.readUInt16BE(2) : (bytes[1] ?? 0) & 0x7f;
  if (bytes.length < begin + length) return undefined;
  const mask = bytes.subarray(begin - 4, begin);
  const plain = bytes.subarray(begin, begin + length).map((byte, at) => byte ^ (mask[at % 4] ?? 0));
  return { opcode: (bytes[0] ?? 0) & 0x0f, text: Buffer.from(plain).toString(), size_bytes: begin + length };
}
