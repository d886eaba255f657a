/** Jogs the stage while a button is held. The server stops the stage 300 ms after the last request in any case. */

/** Repeat interval of requests, well below the server's 300 ms to allow for a slow request. */
const REPEAT_EVERY_MS = 100;

export class Jog {
  private velocity = 0;
  private running = false;
  private wake: (() => void) | undefined;

  /** `send` sends a velocity to the stage; 0 stops it. `failed` is called with the cause of a failure. */
  constructor(
    private readonly send: (velocity: number) => Promise<void>,
    private readonly failed: (cause: unknown) => void,
  ) {}

  /** Called when the button is pressed. */
  hold(velocity: number): void {
    this.velocity = velocity;
    if (!this.running) void this.run();
  }

  /** Called when the button is released or the page is hidden. */
  release(): void {
    this.velocity = 0;
    this.wake?.();
  }

  /** Sends one request after the other, so that none overtakes the stop. */
  private async run(): Promise<void> {
    this.running = true;
    try {
      while (this.velocity !== 0) {
        const begun = performance.now();
        await this.send(this.velocity);
        const rest_ms = REPEAT_EVERY_MS - (performance.now() - begun);
        if (this.velocity !== 0 && rest_ms > 0) await this.rest(rest_ms);
      }
      await this.send(0);
    } catch (cause) {
      this.velocity = 0;
      this.failed(cause);
    } finally {
      this.running = false;
      // Pressed again while the stop request was pending.
      if (this.velocity !== 0) void this.run();
    }
  }

  /** Waits for the next request, or for the release of the button. */
  private async rest(rest_ms: number): Promise<void> {
    await new Promise<void>((resolve) => {
      this.wake = resolve;
      setTimeout(resolve, rest_ms);
    });
    this.wake = undefined;
  }
}
