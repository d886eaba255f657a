/**
 * The live image of the wizard, and the board detected in it by the server.
 *
 * Runs the detection loop: one request at a time, a pause after each, none while an image is captured or the page is
 * hidden.
 */

import { signal } from "@preact/signals";
import { type Api, data, type Problem, problemOf } from "../../../api/client";
import type { App } from "../../../app";
import { CameraExposure } from "../exposures/camera_exposure";
import type { Detection, Session } from "./session_state";
import { Stillness } from "./stillness";

/** Pause between two detections: four per second are enough for a hand-held board and keep the load low. */
const PAUSE_MS = 200;

/** Pause after a failed detection. */
const PAUSE_AFTER_ERROR_MS = 1000;

export class LiveBoard {
  readonly detection = signal<Detection | undefined>(undefined);
  readonly problem = signal<Problem | undefined>(undefined);
  /** Why a changed board exposure does not apply to the live view. */
  readonly exposure_problem = signal<Problem | undefined>(undefined);
  /** Time for which the board has been still, ms. */
  readonly still_ms = signal(0);
  /** Set while an image is captured: detection is paused. */
  paused = false;
  private readonly stillness = new Stillness();
  private timer: ReturnType<typeof setTimeout> | undefined;
  private ended = false;
  private readonly exposure: CameraExposure;
  /** The board exposure that the live view has. */
  private exposed_us: number;
  /** Set when the live view was ended, which the status of the station shows a little later. */
  private stopped = false;

  constructor(
    private readonly app: App,
    private session: Session,
    /** Called after each detection. */
    private readonly onDetection: (detection: Detection, still_ms: number) => void,
  ) {
    this.exposure = new CameraExposure(app);
    this.exposed_us = this.board_exposure_us;
  }

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
    this.stopped = false;
    await this.expose();
    const params = { header: { "Sheaf-Control": control.id() ?? "" } };
    await data(api.PUT("/api/v1/station/live", { params, body: { running: true, laser_power: 0 } }));
    if (this.exposed_us !== this.board_exposure_us) await this.expose();
  }

  /** Ends the live view and restores the previous exposure. */
  async stop(): Promise<void> {
    const { api, control } = this.app;
    this.clear();
    if (!control.mine.peek()) return;
    const params = { header: { "Sheaf-Control": control.id() ?? "" } };
    await data(api.PUT("/api/v1/station/live", { params, body: { running: false, laser_power: 0 } }));
    this.stopped = true;
    this.exposure_problem.value = undefined;
    await this.exposure.restore();
  }

  /** Takes over the newest session; a changed board exposure applies at once to a live view that this page controls. */
  async follow(session: Session): Promise<void> {
    this.session = session;
    const is_live = this.runs && !this.stopped && !this.paused && this.app.control.mine.peek();
    if (!is_live || this.exposed_us === this.board_exposure_us) return;
    try {
      await this.expose();
    } catch (cause) {
      // After a capture the live view starts with the newest exposure.
      this.exposure_problem.value = this.paused ? undefined : problemOf(cause);
    }
  }

  /** Takes control of a running live view that no one controls, so that a changed exposure can apply to it. */
  async takeIfFree(): Promise<void> {
    const { control } = this.app;
    if (this.runs && control.other.peek() === undefined) await control.ensure();
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
    if (this.exposure.is_changed) void this.stop().catch(() => undefined);
  }

  private get board_exposure_us(): number {
    return this.session.body.exposures.board_exposure_us;
  }

  private async expose(): Promise<void> {
    const exposure_us = this.board_exposure_us;
    await this.exposure.set(exposure_us);
    this.exposed_us = exposure_us;
    this.exposure_problem.value = undefined;
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
