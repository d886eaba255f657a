/** The latest state of the station, and its age. */

import { computed, signal } from "@preact/signals";
import type { Schemas, Station } from "../../api/client";
import type { StreamConnection } from "../../stream/connection";
import { STALE_AFTER_MS } from "../../theme";

/** Interval of the check for stale data. */
const CHECK_EVERY_MS = 250;

/** Update rate of positions and counts; state changes are sent at once. */
const STATE_RATE_HZ = 5;

/** Position of a stage in the unit of its kind, if known. */
export function positionOf(stage: Schemas["StageDto"] | undefined): number | undefined {
  return stage?.position_mm ?? stage?.angle_deg ?? undefined;
}

export class StationState {
  /** The newest status; undefined before the first. */
  readonly status = signal<Station | undefined>(undefined);
  /** Seconds since the last message; 0 while the connection is live. */
  readonly stale_s = signal(0);
  readonly stale = computed(() => this.stale_s.value > 0);
  /** Whether the devices are simulated or replayed. */
  readonly simulated = computed(() => this.status.value?.simulated ?? undefined);
  /** Whether the stage is rotary: its positions are degrees. */
  readonly rotary = computed(() => this.status.value?.stage.kind === "rotary");
  /** Unit of the stage's positions. */
  readonly unit = computed(() => (this.rotary.value ? "°" : "mm"));
  /** Position in that unit, if known. */
  readonly position = computed(() => positionOf(this.status.value?.stage));
  /** Lowest and highest position in that unit. */
  readonly travel = computed(
    () => this.status.value?.stage.travel_mm ?? this.status.value?.stage.travel_deg ?? [],
  );
  /** Whether a job uses the station. */
  readonly busy = computed(() => this.status.value?.job_id != null);

  constructor(private readonly stream: StreamConnection) {}

  start(): void {
    this.stream.subscribe({ stream: "state", max_rate_hz: STATE_RATE_HZ }, (message) => {
      if ("op" in message && message.op === "state") this.status.value = message.station;
    });
    setInterval(() => this.checkAge(), CHECK_EVERY_MS);
  }

  private checkAge(): void {
    const silent_ms = performance.now() - this.stream.last_message_at_ms;
    const stale = !this.stream.connected.value || silent_ms > STALE_AFTER_MS;
    this.stale_s.value = stale ? Math.max(1, Math.round(silent_ms / 1000)) : 0;
  }
}
