/** The text messages of `sheaf.v1`. */

import type { Job, Station } from "../api/client";

export type StreamName = "image" | "profile" | "points" | "state" | "jobs" | "events";

/** The demand of a part of the page on a stream. */
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

/** How many messages of a stream this page did not get, and why. */
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
