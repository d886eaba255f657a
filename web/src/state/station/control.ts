/** The control lease: who is in control of the station, and whether it is this page. */

import { computed, signal } from "@preact/signals";
import { type Api, data, ProblemError, type Schemas } from "../../api/client";
import { remembered } from "../browser/remembered";
import type { StationState } from "./station";

/** The lease lasts five seconds; the interval tolerates a lost request. */
const RENEW_EVERY_MS = 1500;

/** HTTP status of a renewal whose lease is no longer valid. */
const CONFLICT = 409;

const EXPIRED = "urn:sheaf:problem:control-expired";

/**
 * Why this page lost control. `idle`: no commands were sent; `not_renewed`: the connection was lost or the page was
 * suspended.
 */
export type Loss = { kind: "taken"; by: string } | { kind: "idle" } | { kind: "not_renewed" };

export class Control {
  /** The name shown to others. */
  readonly holder = remembered("holder", "");
  private readonly lease = signal<Schemas["ControlLeaseDto"] | undefined>(undefined);
  /** Whether this page is in control. */
  readonly mine = computed(() => this.lease.value !== undefined);
  /** The name of another holder of control. */
  readonly other = computed(() => {
    const control = this.station.status.value?.control;
    return control && !this.mine.value ? control.holder : undefined;
  });
  /** How this page lost control, until the user dismisses the message. */
  readonly lost = signal<Loss | undefined>(undefined);
  private renewed_at_ms = 0;
  /** How long a renewed lease lasts. */
  private length_ms = 0;

  constructor(
    private readonly station: StationState,
    private readonly api: () => Api,
  ) {}

  start(): void {
    setInterval(() => void this.renew(), RENEW_EVERY_MS);
    // Timers of hidden pages are throttled: renew at once when the page becomes visible.
    document.addEventListener("visibilitychange", () => void this.renew());
    addEventListener("pagehide", () => void this.release());
  }

  /** The name that the user has entered, if any. */
  get entered_name(): string | undefined {
    return this.holder.value.trim() || undefined;
  }

  /** The name in logs and other browsers. */
  get name(): string {
    return this.entered_name ?? "Operator";
  }

  /** The id to send with commands. */
  id(): string | undefined {
    return this.lease.value?.id;
  }

  /** Takes control if it is free; from another holder only with `take_over`. */
  async take(take_over = false): Promise<void> {
    const body = { holder: this.name, take_over };
    this.note(await data(this.api().POST("/api/v1/station/control", { body })));
    this.lost.value = undefined;
  }

  /** Manual commands need control: takes it if it is free, refuses if someone else has it. */
  async ensure(): Promise<void> {
    if (!this.mine.value) await this.take();
  }

  async release(): Promise<void> {
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
      // Ignore the response if control was released or taken again in the meantime.
      if (this.id() === id) this.note(renewed);
    } catch (cause) {
      // The lease stays valid on an unreachable or busy server until it expires; a conflict means that it has.
      if (!(cause instanceof ProblemError) || cause.problem.status !== CONFLICT || this.id() !== id) return;
      const asleep = performance.now() - this.renewed_at_ms > this.length_ms;
      this.lease.value = undefined;
      if (cause.problem.type === EXPIRED) this.lost.value = { kind: asleep ? "not_renewed" : "idle" };
      else this.lost.value = lossTo(await this.currentHolder());
    }
  }

  private note(lease: Schemas["ControlLeaseDto"]): void {
    this.lease.value = lease;
    // Without commands the server renews the lease for decreasing times.
    this.length_ms = Math.max(this.length_ms, 1000 * lease.expires_in_s);
    this.renewed_at_ms = performance.now();
  }

  /** The current holder of control; empty if no one is. The stream may lag behind. */
  private async currentHolder(): Promise<string> {
    const asked = data(this.api().GET("/api/v1/station/control"));
    return await asked.then(({ holder }) => holder).catch(() => "");
  }
}

/** A restarted server has no lease, so no one is in control. */
function lossTo(holder: string): Loss {
  return holder === "" ? { kind: "not_renewed" } : { kind: "taken", by: holder };
}
