/** Moves the stage for as long as a button is held. The server stops it 300 ms after the last word in any case. */

/** Well within the server's 300 ms, with room for a request that takes longer. */
const REPEAT_EVERY_MS = 100;

export class Jog {
  private velocity = 0;
  private running = false;
  private wake: (() => void) | undefined;

  /** `send` sends a velocity to the stage; 0 stops. `failed` gets the reason of a failure. */
  constructor(
    private readonly send: (velocity: number) => Promise<void>,
    private readonly failed: (cause: unknown) => void,
  ) {}

  /** The button is down. */
  hold(velocity: number): void {
    this.velocity = velocity;
    if (!this.running) void this.run();
  }

  /** The button is up, or the page is out of sight. */
  release(): void {
    this.velocity = 0;
    this.wake?.();
  }

  /** One request after the other, never two at once, so that none overtakes the stop. */
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
      // Pressed again while the stop was under way.
      if (this.velocity !== 0) void this.run();
    }
  }

  /** Waits for the next turn, or for the button. */
  private async rest(rest_ms: number): Promise<void> {
    await new Promise<void>((resolve) => {
      this.wake = resolve;
      setTimeout(resolve, rest_ms);
    });
    this.wake = undefined;
  }
}
