/** The exposure of the camera while the live view of a session runs; afterwards the previous one is restored. */

import { data } from "../../../api/client";
import type { App } from "../../../app";
import { coalesced } from "../../../state/coalesced";

export class CameraExposure {
  /** The exposure before it was set; `undefined` if there is nothing to restore. */
  private before_us: number | undefined;
  /** `undefined`: the exposure before. */
  private wanted_us: number | undefined;
  /** Requests never overlap; the last one prevails. */
  private readonly settle = coalesced(() => this.request());

  constructor(private readonly app: App) {}

  /** Whether there is an exposure to restore. */
  get is_changed(): boolean {
    return this.before_us !== undefined;
  }

  async set(exposure_us: number): Promise<void> {
    this.wanted_us = exposure_us;
    await this.settle();
  }

  async restore(): Promise<void> {
    this.wanted_us = undefined;
    await this.settle();
  }

  private async request(): Promise<void> {
    if (this.wanted_us !== undefined) {
      const before_us = await setExposure(this.app, this.wanted_us);
      this.before_us ??= before_us;
    } else if (this.before_us !== undefined) {
      await setExposure(this.app, this.before_us);
      this.before_us = undefined;
    }
  }
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
