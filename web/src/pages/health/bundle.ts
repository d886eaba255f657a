/** The support bundle: everything about the station from the public API, in one file. */

import { type Api, bytes, data, problemOf } from "../../api/client";
import type { App } from "../../app";

/** Format of the file. */
const FORMAT = "sheaf-support/1";

/** Requests everything in parallel; a failed request is replaced by its problem. */
export async function supportBundle({ api, stream, station, events }: App): Promise<unknown> {
  const parts: Record<string, Promise<unknown>> = {
    station: data(api.GET("/api/v1/station")),
    health: data(api.GET("/health")),
    ready: data(api.GET("/ready")),
    jobs: data(api.GET("/api/v1/jobs", { params: { query: { limit: 100 } } })),
    events: newestEvents(api, events.list.peek()[0]?.seq ?? 0),
    scans: data(api.GET("/api/v1/scans", { params: { query: { limit: 20 } } })),
    calibrations: data(api.GET("/api/v1/calibrations", { params: { query: { limit: 5 } } })),
    activations: data(api.GET("/api/v1/calibrations/activations", { params: { query: { limit: 50 } } })),
    doors: data(api.GET("/api/v1/doors")),
    metrics: bytes("/metrics").then((response) => response.text()),
  };
  const answers = Object.entries(parts).map(async ([name, asked]) => {
    const answer = await asked.catch((cause: unknown) => ({ problem: problemOf(cause) }));
    return [name, answer] as const;
  });
  return {
    format: FORMAT,
    made_at: new Date().toISOString(),
    page: {
      address: location.href,
      browser: navigator.userAgent,
      round_trip_ms: stream.round_trip_ms.peek(),
      viewer_dropped: stream.dropped.peek(),
      stale_s: station.stale_s.peek(),
    },
    ...Object.fromEntries(await Promise.all(answers)),
  };
}

/** The newest 200 events; `newest_seq` is the end of the log. */
async function newestEvents(api: Api, newest_seq: number): Promise<unknown> {
  const after = Math.max(0, newest_seq - 200);
  return await data(api.GET("/api/v1/events", { params: { query: { after, limit: 200 } } }));
}

/** Downloads a value as a JSON file. */
export function download(name: string, value: unknown): void {
  save(name, new Blob([JSON.stringify(value, null, 2)], { type: "application/json" }));
}

/** Downloads bytes as a file. */
export function save(name: string, content: Blob): void {
  const href = URL.createObjectURL(content);
  const link = document.createElement("a");
  link.href = href;
  link.download = name;
  link.click();
  URL.revokeObjectURL(href);
}
