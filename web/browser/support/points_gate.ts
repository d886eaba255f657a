/**
 * Lets the first blocks of points through to a page and holds the others, so that a cloud in the middle of its growth
 * can be looked at for as long as a slow machine needs.
 */

import type { Page } from "playwright-core";

/** Of the stream: the opcode of a block of points, and where a block says how many it has. */
const POINTS = 3;
const N_POINTS_AT = 36;

export class PointsGate {
  /** Points of the blocks that went through. */
  n_points = 0;
  private readonly held: (() => void)[] = [];

  private constructor(private n_blocks_left: number) {}

  /** Intercepts the connections that the page opens from now on. */
  static async before(page: Page, n_blocks: number): Promise<PointsGate> {
    const gate = new PointsGate(n_blocks);
    await page.routeWebSocket(/\/api\/v1\/stream$/, (socket) => {
      socket.connectToServer().onMessage((message) => gate.hear(message, () => socket.send(message)));
    });
    await page.route("**/api/v1/scans/*/points?**", (route) => gate.pass(() => void route.continue()));
    return gate;
  }

  /** Whether all that may pass has passed. */
  get closed(): boolean {
    return this.n_blocks_left === 0;
  }

  /** Forwards the held messages in order, and all that follow. */
  open(): void {
    this.n_blocks_left = Number.POSITIVE_INFINITY;
    for (const go_on of this.held.splice(0)) go_on();
  }

  private hear(message: string | Buffer, send: () => void): void {
    const block = typeof message !== "string" && message[0] === POINTS ? message : undefined;
    const ended = typeof message === "string" && message.includes('"scan"');
    if (this.closed && (block || ended)) {
      this.held.push(send);
      return;
    }
    this.n_blocks_left -= block ? 1 : 0;
    this.n_points += block?.readUInt32LE(N_POINTS_AT) ?? 0;
    send();
  }

  private pass(go_on: () => void): void {
    if (this.closed) this.held.push(go_on);
    else go_on();
  }
}
