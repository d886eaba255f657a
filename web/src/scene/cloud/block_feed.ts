/**
 * The points of one scan, every block once and in order: live blocks from the stream, missing ones over HTTP.
 *
 * Blocks are numbered from 0 without gaps. Early blocks are buffered, duplicates are discarded. After an interruption
 * the last block is requested again: if it differs, the scan was resumed from an earlier row after a restart of the
 * server, and all blocks are loaded again.
 */

import { decodeBlocks, type PointsBlock } from "../../stream/protocol";

/** A response of `GET …/points`. */
export interface PointsPage {
  buffer: ArrayBuffer;
  next_block: number;
  complete: boolean;
}

export interface FeedEvents {
  onBlock(block: PointsBlock): void;
  /** All previous points are invalid; another scan, or the same from its beginning, follows. */
  onReset(scan_id: string): void;
  /** Loading blocks failed. */
  onProblem(cause: unknown): void;
  /** The progress or the end of the scan changed. */
  onProgress?(): void;
}

export class BlockFeed {
  /** The id of the scan. */
  scan_id: string | undefined;
  /** Whether more blocks will come. */
  running = false;
  /** The next block needed, which is also the number of blocks received. */
  next_block = 0;
  private last: PointsBlock | undefined;
  private readonly buffered = new Map<number, PointsBlock>();
  private fetching = false;
  private again = false;

  constructor(
    private readonly fetchPage: (scan_id: string, from_block: number) => Promise<PointsPage>,
    private readonly events: FeedEvents,
  ) {}

  /** Processes the stream's message about the current scan and its next block. */
  announce(scan: { scan_id: string; running: boolean; n_blocks: number; next_block: number }): void {
    const resumed = scan.running && !this.running;
    if (scan.scan_id !== this.scan_id || resumed) this.reset(scan.scan_id);
    this.running = scan.running;
    if (this.next_block < Math.max(scan.next_block, scan.running ? 0 : scan.n_blocks)) void this.catchUp();
    this.events.onProgress?.();
  }

  /** Processes a block of the stream. */
  receive(block: PointsBlock): void {
    if (block.scan_id !== this.scan_id || block.block < this.next_block) return;
    if (block.block > this.next_block || this.fetching) {
      this.buffered.set(block.block, block);
      if (!this.fetching) void this.catchUp();
      return;
    }
    this.take(block);
    this.takeBuffered();
  }

  /** Shows a scan from its beginning. */
  async show(scan_id: string): Promise<void> {
    this.reset(scan_id);
    await this.catchUp();
  }

  /** Called after a reconnect: loads missing blocks. */
  reconnected(): void {
    if (this.scan_id !== undefined) void this.catchUp();
  }

  /** Requests missing blocks until there are none. */
  async catchUp(): Promise<void> {
    this.again = true;
    if (this.fetching) return;
    this.fetching = true;
    try {
      while (this.again) {
        this.again = false;
        await this.fetchAll();
      }
    } catch (cause) {
      this.events.onProblem(cause);
    } finally {
      this.fetching = false;
      this.takeBuffered();
    }
  }

  private async fetchAll(): Promise<void> {
    const scan_id = this.scan_id;
    if (scan_id === undefined) return;
    for (;;) {
      // Start with the last known block, to check whether it is unchanged.
      const from_block = Math.max(0, this.next_block - 1);
      const page = await this.fetchPage(scan_id, from_block);
      if (this.scan_id !== scan_id) return;
      const before = this.next_block;
      const blocks = decodeBlocks(page.buffer);
      if (this.last && !(blocks[0] && samePoints(blocks[0], this.last))) {
        // A scan waiting to be resumed has no blocks; its points stay until new rows are captured.
        if (page.complete && page.next_block === 0) return this.end();
        this.reset(scan_id);
        continue;
      }
      for (const block of blocks) if (block.block === this.next_block) this.take(block);
      if (page.complete) return this.end();
      if (this.next_block === before) return;
    }
  }

  private takeBuffered(): void {
    for (let block = this.buffered.get(this.next_block); block; block = this.buffered.get(this.next_block)) {
      this.take(block);
    }
    for (const number of this.buffered.keys()) if (number < this.next_block) this.buffered.delete(number);
  }

  private take(block: PointsBlock): void {
    this.buffered.delete(block.block);
    this.next_block = block.block + 1;
    this.last = block;
    this.events.onBlock(block);
  }

  private end(): void {
    this.running = false;
    this.events.onProgress?.();
  }

  private reset(scan_id: string): void {
    this.scan_id = scan_id;
    this.next_block = 0;
    this.last = undefined;
    this.buffered.clear();
    this.events.onReset(scan_id);
  }
}

/** Whether two blocks hold the same points. */
function samePoints(a: PointsBlock, b: PointsBlock): boolean {
  if (a.block !== b.block || a.frame !== b.frame || a.n_points !== b.n_points) return false;
  return a.points.every((byte, idx) => byte === b.points[idx]);
}
