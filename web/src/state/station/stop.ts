/** Stop: requested over HTTP and WebSocket at once, repeatedly, until the station is known to have stopped. */

import { effect, signal } from "@preact/signals";
import type { StopResult } from "../../api/client";
import type { StreamConnection } from "../../stream/connection";
import type { StationState } from "./station";

/** Time between two attempts; none waits for the one before. */
const REPEAT_EVERY_MS = 500;

/** Time without a response after which the page advises the machine's emergency stop; attempts continue. */
const NO_RESPONSE_AFTER_MS = 1500;

/**
 * Maximum number of pending requests. A browser has six connections per server: if requests hang on dead connections,
 * the oldest is aborted after ten seconds to allow a new one. No other attempt is aborted before the station has
 * stopped.
 */
const MAX_PENDING = 20;

/** Result of the last Stop. `unacknowledged`: received by the server, not confirmed by the devices. */
export type StopOutcome = "none" | "stopping" | "no_response" | "unacknowledged";

/** Requests Stop over HTTP. */
export type PostStop = (abort: AbortSignal) => Promise<StopResult>;

export class Stop {
  readonly outcome = signal<StopOutcome>("none");
  private readonly pending = new Set<AbortController>();
  private cleanups: (() => void)[] = [];

  constructor(
    private readonly stream: Pick<StreamConnection, "stop" | "onStopped" | "onReconnect">,
    private readonly station: Pick<StationState, "status">,
    private readonly post: PostStop,
    private readonly actor: () => string,
  ) {}

  /** Requests Stop; the first attempt is sent synchronously. */
  press(): void {
    this.attempt();
    if (this.outcome.peek() === "none") this.repeatUntilKnown();
  }

  private attempt(): void {
    this.stream.stop(this.actor());
    const abort = new AbortController();
    this.pending.add(abort);
    this.post(abort.signal)
      .then(
        (answer) => {
          if (this.pending.has(abort)) this.answered(answer);
        },
        // Server not reached: the next attempt follows in any case.
        () => undefined,
      )
      .finally(() => this.pending.delete(abort));
    const [oldest] = this.pending;
    if (this.pending.size > MAX_PENDING && oldest) this.abandon(oldest);
  }

  /** Repeats the request until its outcome is known. */
  private repeatUntilKnown(): void {
    this.outcome.value = "stopping";
    const repeat = setInterval(() => this.attempt(), REPEAT_EVERY_MS);
    const warning = setTimeout(() => {
      if (this.outcome.peek() === "stopping") this.outcome.value = "no_response";
    }, NO_RESPONSE_AFTER_MS);
    this.cleanups = [
      () => clearInterval(repeat),
      () => clearTimeout(warning),
      this.stream.onStopped((answer) => this.answered(answer)),
      this.stream.onReconnect(() => this.attempt()),
      this.followState(),
    ];
  }

  private answered({ acknowledged, state }: StopResult): void {
    if (this.outcome.peek() === "none") return;
    if (acknowledged === false) this.outcome.value = "unacknowledged";
    else if (acknowledged || state === "Halted") this.end();
  }

  /** Ends the attempts when the station reports that it has stopped. */
  private followState(): () => void {
    const before = this.station.status.peek();
    let halted = false;
    return effect(() => {
      const status = this.station.status.value;
      if (!status || status === before) return;
      // Devices that did not confirm are checked again, unless the station was reset.
      const known = status.state === "Halted" ? this.outcome.peek() !== "unacknowledged" : halted;
      halted ||= status.state === "Halted";
      if (known) queueMicrotask(() => this.end());
    });
  }

  /** Cancels pending requests, so that none of them arrives after a reset. */
  private end(): void {
    for (const end of this.cleanups.splice(0)) end();
    for (const abort of this.pending) this.abandon(abort);
    this.outcome.value = "none";
  }

  private abandon(attempt: AbortController): void {
    this.pending.delete(attempt);
    attempt.abort();
  }
}
