/** The station as this page last saw it, and how old that is. */

import { computed, signal } from "@preact/signals";
import type { Station } from "../../api/client";
import type { StreamConnection } from "../../stream/connection";
import { STALE_AFTER_MS } from "../../theme";

/** The page looks so often whether what it shows has become stale. */
const LOOK_EVERY_MS = 250;

/** Positions and counts are told so often; what matters, changes of state, comes at once. */
const TOLD_HZ = 5;

export class StationState {
  /** The newest status; undefined before the first. */
  readonly status = signal<Station | undefined>(undefined);
  /** How long nothing was heard, seconds; 0 while the link lives. */
  readonly stale_s = signal(0);
  readonly stale = computed(() => this.stale_s.value > 0);
  /** Whether the devices are simulated or replayed. */
  readonly simulated = computed(() => this.status.value?.simulated ?? undefined);
  /** Whether the stage turns: its positions are degrees. */
  readonly rotary = computed(() => this.status.value?.stage.kind === "rotary");
  /** Unit of the stage's positions. */
  readonly unit = computed(() => (this.rotary.value ? "°" : "mm"));
  /** Whether the station carries something out. */
  readonly busy = computed(() => this.status.value?.job_id != null);

  constructor(private readonly stream: StreamConnection) {}

  start(): void {
    this.stream.subscribe({ stream: "state", max_rate_hz: TOLD_HZ }, (message) => {
      if ("op" in message && message.op === "state") this.status.value = message.station;
    });
    setInterval(() => this.look(), LOOK_EVERY_MS);
  }

  private look(): void {
    const silent_ms = performance.now() - this.stream.last_message_at_ms;
    const stale = !this.stream.connected.value || silent_ms > STALE_AFTER_MS;
    this.stale_s.value = stale ? Math.max(1, Math.round(silent_ms / 1000)) : 0;
  }
}
