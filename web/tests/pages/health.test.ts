/** When Health speaks up. */

import { expect, test } from "vitest";
import { eventActor, eventDetail } from "../../src/pages/health/event_text";
import { parseMetrics } from "../../src/pages/health/metrics";
import {
  ageDays,
  calibrationTone,
  deviceTone,
  diskTone,
  doorTone,
  framesTone,
  linkTone,
  pairDisagrees,
  queueTone,
  worstTone,
} from "../../src/pages/health/tone";
import { de } from "../../src/text/de";
import { en } from "../../src/text/en";

test("metrics are read with their labels; histograms are left out", () => {
  const text = [
    "# TYPE sheaf_store_free_bytes gauge",
    "sheaf_store_free_bytes 44611129344",
    'sheaf_jobs{state="queued"} 2',
    'sheaf_http_request_seconds_bucket{le="+Inf"} 1',
    "",
  ].join("\n");
  expect([...parseMetrics(text)]).toEqual([
    ["sheaf_store_free_bytes", 44611129344],
    ['sheaf_jobs{state="queued"}', 2],
  ]);
});

test("a device that is away or has a fault is an alarm", () => {
  const fault = { device: "stage", kind: "disconnected", detail: "", remedy: "", since_ms: 0 };
  expect(deviceTone(true, [fault], "camera")).toBe("calm");
  expect(deviceTone(true, [fault], "stage")).toBe("alarm");
  expect(deviceTone(false, [], "laser")).toBe("alarm");
});

test("frames lost inside the service are reported at once, a few at the camera are not", () => {
  expect(framesTone({ arrived: 1000, dropped: { camera: 2, recorder: 0 } })).toBe("calm");
  expect(framesTone({ arrived: 1000, dropped: { camera: 60 } })).toBe("caution");
  expect(framesTone({ arrived: 1000, dropped: { camera: 0, recorder: 1 } })).toBe("caution");
});

test("link, disk, queue and calibration warn in time", () => {
  const slow = { stream: "image", offered: 1000, sent: 500, by_rate: 0, too_slow: 500 } as const;
  expect(linkTone(false, 3, [])).toBe("calm");
  expect(linkTone(true, 3, [])).toBe("alarm");
  expect(linkTone(false, 400, [])).toBe("caution");
  expect(linkTone(false, 3, [slow])).toBe("caution");
  expect(linkTone(false, 3, [{ ...slow, too_slow: 0, by_rate: 500 }])).toBe("calm");
  expect(diskTone(undefined, false)).toBe("calm");
  expect(diskTone(1e12, true)).toBe("alarm");
  expect(diskTone(2e9, false)).toBe("caution");
  expect(diskTone(1e8, false)).toBe("alarm");
  expect(queueTone(3)).toBe("calm");
  expect(queueTone(30)).toBe("caution");
  const day_ms = 86_400_000;
  expect(ageDays(0, 1.5 * day_ms)).toBe(1);
  expect(ageDays(day_ms, 0)).toBe(0);
  expect(calibrationTone(undefined, 0)).toBe("caution");
  expect(calibrationTone(0, 10 * day_ms)).toBe("calm");
  expect(calibrationTone(0, 40 * day_ms)).toBe("caution");
});

test("a door that waits or has dead letters is a caution, a closed one is an alarm", () => {
  expect(doorTone({ state: "delivering", n_dead: 0 })).toBe("calm");
  expect(doorTone({ state: "waiting", n_dead: 0 })).toBe("caution");
  expect(doorTone({ state: "delivering", n_dead: 1 })).toBe("caution");
  expect(doorTone({ state: "closed", n_dead: 1 })).toBe("alarm");
  expect(worstTone([])).toBe("calm");
  expect(worstTone(["calm", "caution"])).toBe("caution");
  expect(worstTone(["caution", "alarm", "calm"])).toBe("alarm");
});

test("orders disagree beyond three standard deviations of the calibration", () => {
  const pair = { order_a: -1, order_b: 0, n_pairs: 9, bias_mm: -0.025, rms_mm: 0.05 };
  expect(pairDisagrees(pair, 0.007)).toBe(true);
  expect(pairDisagrees(pair, 0.01)).toBe(false);
  expect(pairDisagrees(pair, undefined)).toBe(false);
});

test("every act at the station has words in both languages, and says who did it", () => {
  const kinds = [
    ["station.stopped", "station.reset", "stage.moved", "stage.homed", "stage.jogged", "laser.switched"],
    ["camera.configured", "live.started", "live.ended"],
    ["control.taken", "control.taken_over", "control.released", "control.expired"],
  ].flat();
  for (const words of [en, de])
    for (const kind of kinds) expect(words.health.event_kinds[kind], kind).toBeDefined();
  expect(eventActor({ body: { actor: "Anna", source: "websocket" } })).toBe("by Anna (WebSocket)");
  expect(eventActor({ body: { actor: "Anna", source: "modbus" } })).toBe("by Anna (modbus)");
  expect(eventActor({ body: { actor: "Anna" } })).toBe("by Anna");
  expect(eventActor({ body: { source: "rest" } })).toBe("");
  expect(eventActor({ body: null })).toBe("");
});

test("an event shows the readable part of its body", () => {
  expect(eventDetail({ body: { kind: "scan", message: "12 points", problem: null } })).toBe("12 points");
  expect(eventDetail({ body: { message: "x", problem: { detail: "the stage stalled" } } })).toBe(
    "the stage stalled",
  );
  expect(eventDetail({ body: { from: "Anna", to: "Ben" } })).toBe("Anna → Ben");
  expect(eventDetail({ body: { name: "SN-1", verdict: "pass" } })).toBe("SN-1, pass");
  expect(eventDetail({ body: null })).toBe("");
});
