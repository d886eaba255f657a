/**
 * The live image of the wizard, and the board detected in it by the server.
 *
 * Runs the detection loop: one request at a time, a pause after each, none while an image is captured or the page is
 * hidden.
 */

import { signal } from "@preact/signals";
import { type Api, data, type Problem, problemOf } from "../../../api/client";
import type { App } from "../../../app";
import type { Detection, Session } from "./session_state";
import { Stillness } from "./stillness";

/** Pause between two detections: four per second are enough for a hand-held board and keep the load low. */
const PAUSE_MS = 200;

/** Pause after a failed detection. */
const PAUSE_AFTER_ERROR_MS = 1000;

export class LiveBoard {
  readonly detection = signal<Detection | undefined>(undefined);
  readonly problem = signal<Problem | undefined>(undefined);
  /** Time for which the board has been still, ms. */
  readonly still_ms = signal(0);
  /** Set while an image is captured: detection is paused. */
  paused = false;
  private readonly stillness = new Stillness();
  private timer: ReturnType<typeof setTimeout> | undefined;
  private ended = false;
  private exposure_before_us: number | undefined;

  constructor(
    private readonly app: App,
    private readonly session: Session,
    /** Called after each detection. */
    private readonly onDetection: (detection: Detection, still_ms: number) => void,
  ) {}

  /** Whether the live view runs. */
  get runs(): boolean {
    return this.app.station.status.value?.state === "Operational.ContinuousExecution";
  }

  /** Starts the detection loop, which is active while the live view runs. */
  startDetection(): void {
    this.timer = setTimeout(() => void this.detectOnce(), 0);
  }

  /** Starts the live view with the laser off, at the exposure of the session's board images. */
  async start(): Promise<void> {
    const { api, control } = this.app;
    await control.ensure();
    this.exposure_before_us ??= await setExposure(this.app, this.session.body.exposures.board_exposure_us);
    const params = { header: { "Sheaf-Control": control.id() ?? "" } };
    await data(api.PUT("/api/v1/station/live", { params, body: { running: true, laser_power: 0 } }));
  }

  /** Ends the live view and restores the previous exposure. */
  async stop(): Promise<void> {
    const { api, control } = this.app;
    this.clear();
    if (!control.mine.peek()) return;
    const params = { header: { "Sheaf-Control": control.id() ?? "" } };
    await data(api.PUT("/api/v1/station/live", { params, body: { running: false, laser_power: 0 } }));
    if (this.exposure_before_us !== undefined) await setExposure(this.app, this.exposure_before_us);
    this.exposure_before_us = undefined;
  }

  /** Resets the detection after the board was moved. */
  clear(): void {
    this.detection.value = undefined;
    this.still_ms.value = 0;
    this.stillness.reset();
  }

  dispose(): void {
    this.ended = true;
    clearTimeout(this.timer);
    if (this.exposure_before_us !== undefined) void this.stop().catch(() => undefined);
  }

  private async detectOnce(): Promise<void> {
    let pause_ms = PAUSE_MS;
    if (this.runs && !this.paused && !document.hidden) {
      try {
        const detection = await detectBoard(this.app.api, this.session.id);
        // Ignore the response if the loop was stopped or a capture started in the meantime.
        if (this.ended) return;
        if (this.runs && !this.paused) this.accept(detection);
        this.problem.value = undefined;
      } catch (cause) {
        this.problem.value = this.paused ? undefined : problemOf(cause);
        pause_ms = PAUSE_AFTER_ERROR_MS;
      }
    } else if (!this.runs && this.detection.peek()) this.clear();
    if (!this.ended) this.timer = setTimeout(() => void this.detectOnce(), pause_ms);
  }

  private accept(detection: Detection): void {
    this.still_ms.value = this.stillness.follow(detection);
    this.detection.value = detection;
    this.onDetection(detection, this.still_ms.peek());
  }
}

async function detectBoard(api: Api, id: string): Promise<Detection> {
  return await data(api.POST("/api/v1/calibration-sessions/{id}/detect-board", { params: { path: { id } } }));
}

/** Sets the exposure; returns the previous one. */
async function setExposure({ api, control }: App, exposure_us: number): Promise<number> {
  const response = await api.GET("/api/v1/devices/camera/settings");
  const before_us = (await data(Promise.resolve(response))).exposure_us;
  if (before_us === exposure_us) return before_us;
  const header = { "Sheaf-Control": control.id() ?? "", "If-Match": response.response.headers.get("etag") ?? "*" };
  await data(api.PATCH("/api/v1/devices/camera/settings", { params: { header }, body: { exposure_us } }));
  return before_us;
}
