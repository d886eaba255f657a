/** The text messages of `sheaf.v1`. */

import type { Job, Station } from "../api/client";
import { fieldOf } from "../api/unknown";

export type StreamName = "image" | "profile" | "points" | "state" | "jobs" | "events";

/** A subscription to a stream. */
export interface Subscription {
  stream: StreamName;
  max_rate_hz?: number;
  scale?: 1 | 2 | 4;
  from_block?: number;
}

export type ClientText =
  | { op: "subscribe"; id?: number; streams: Subscription[] }
  | { op: "unsubscribe"; id?: number; streams: StreamName[] }
  | { op: "ping"; id: number }
  | { op: "stop"; id?: number; actor?: string };

/** Messages of a stream that were not sent to this page, by reason. */
export interface DropCount {
  stream: StreamName;
  offered: number;
  sent: number;
  by_rate: number;
  too_slow: number;
}

export type ServerText =
  | { op: "hello"; protocol: string; software_version: string; clock_ms: number | null }
  | { op: "subscribed"; id?: number; streams: Subscription[] }
  | { op: "pong"; id?: number; clock_ms: number | null }
  | { op: "error"; code: string; detail: string; id?: number }
  | { op: "state"; changes: { number: number; state: string }[]; station: Station }
  | { op: "job"; job: Job }
  | { op: "event"; seq: number }
  | { op: "scan"; scan_id: string; running: boolean; n_blocks: number; next_block: number }
  | { op: "dropped"; streams: DropCount[] }
  | { op: "stopped"; id?: number; acknowledged: boolean; state: string; detail: string | null };

/** Whether a parsed message has a known `op`. Its fields are guaranteed by the server (`openapi/stream.md`). */
export function isServerText(message: unknown): message is ServerText {
  return OPS.has(fieldOf(message, "op"));
}

const OPS: ReadonlySet<unknown> = new Set<ServerText["op"]>([
  "hello",
  "subscribed",
  "pong",
  "error",
  "state",
  "job",
  "event",
  "scan",
  "dropped",
  "stopped",
]);
