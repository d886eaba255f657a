/**
 * A job that a page sees at work for as long as it is looked at: what the server tells in the middle of one, and of
 * which a real job gives only moments.
 */

import type { Page, WebSocketRoute } from "playwright-core";
import type { Job, Station } from "../../src/api/client";

export class StagedJob {
  private readonly sockets = new Set<WebSocketRoute>();

  private constructor(
    private job: Job,
    private readonly others: readonly Job[],
  ) {}

  /** Intercepts all messages about jobs; `others`: earlier jobs. */
  static async before(page: Page, job: Job, others: readonly Job[]): Promise<StagedJob> {
    const staged = new StagedJob(job, others);
    await page.routeWebSocket(/\/api\/v1\/stream$/, (socket) => {
      staged.sockets.add(socket);
      socket.connectToServer().onMessage((message) => socket.send(staged.retold(message)));
    });
    const items = () => [staged.job, ...staged.others];
    await page.route(/\/api\/v1\/jobs(\?|$)/, (route) => route.fulfill({ json: { items: items() } }));
    await page.route(`**/api/v1/jobs/${job.id}`, (route) => route.fulfill({ json: staged.job }));
    return staged;
  }

  /** Tells how far the job is now. */
  tell(change: Partial<Job>): void {
    this.job = { ...this.job, ...change };
    for (const socket of this.sockets) socket.send(JSON.stringify({ op: "job", job: this.job }));
  }

  /** The server's status, with the station working for the job. */
  private retold(message: string | Buffer): string | Buffer {
    if (typeof message !== "string") return message;
    const told = JSON.parse(message) as { op: string; station?: Station };
    if (!told.station) return message;
    const { id, message: activity } = this.job;
    const station = { ...told.station, state: "Operational.SingleExecution", job_id: id, activity };
    return JSON.stringify({ ...told, station });
  }
}
