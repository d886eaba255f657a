/** The control lease: who commands the station, and whether that is this page. */

import { computed, signal } from "@preact/signals";
import { type Api, data, Refusal, type Schemas } from "../api/client";
import { remembered } from "./remembered";
import type { StationState } from "./station";

/** The lease lasts five seconds; it is renewed with room for a lost request. */
const RENEW_EVERY_MS = 1500;

export class Control {
  /** The name shown to others. */
  readonly holder = remembered("holder", "");
  private readonly lease = signal<Schemas["ControlLeaseDto"] | undefined>(undefined);
  /** Whether this page commands. */
  readonly mine = computed(() => this.lease.value !== undefined);
  /** Who else commands. */
  readonly other = computed(() => {
    const control = this.station.status.value?.control;
    return control && !this.mine.value ? control.holder : undefined;
  });
  /** Who took control from this page, until it is acknowledged. */
  readonly lost_to = signal<string | undefined>(undefined);

  constructor(
    private readonly station: StationState,
    private readonly api: () => Api,
  ) {}

  start(): void {
    setInterval(() => void this.renew(), RENEW_EVERY_MS);
    addEventListener("pagehide", () => void this.giveBack());
  }

  /** How logs and other browsers call who sits here. */
  get name(): string {
    return this.holder.value.trim() || "Operator";
  }

  /** The id to send with commands. */
  id(): string | undefined {
    return this.lease.value?.id;
  }

  /** Takes control where nobody has it; from somebody else only with `take_over`. */
  async take(take_over = false): Promise<void> {
    const body = { holder: this.name, take_over };
    this.lease.value = await data(this.api().POST("/api/v1/station/control", { body }));
    this.lost_to.value = undefined;
  }

  /** Commands by hand need control: takes it if it is free, refuses if somebody else has it. */
  async ensure(): Promise<void> {
    if (!this.mine.value) await this.take();
  }

  async giveBack(): Promise<void> {
    const id = this.id();
    if (!id) return;
    this.lease.value = undefined;
    const params = { header: { "Sheaf-Control": id } };
    await this.api()
      .DELETE("/api/v1/station/control", { params, keepalive: true })
      .catch(() => undefined);
  }

  private async renew(): Promise<void> {
    const id = this.id();
    if (!id) return;
    const params = { header: { "Sheaf-Control": id } };
    try {
      const renewed = await data(this.api().PUT("/api/v1/station/control", { params }));
      // Given back, or taken anew, while the answer was under way.
      if (this.id() === id) this.lease.value = renewed;
    } catch (cause) {
      // An unreachable server keeps the lease until it runs out there; a refusal means that it has.
      if (cause instanceof Refusal && this.id() === id) {
        this.lease.value = undefined;
        this.lost_to.value = await this.present();
      }
    }
  }

  /** Who commands at this moment; empty if nobody does. The stream may not have told it yet. */
  private async present(): Promise<string> {
    const asked = data(this.api().GET("/api/v1/station/control"));
    return await asked.then(({ holder }) => holder).catch(() => "");
  }
}
