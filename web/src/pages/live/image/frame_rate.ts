/** The display rate over the last seconds. */

/** The time over which frames are counted. */
const WINDOW_MS = 2000;

/** More frames than ever occur in the window. */
const KEPT = 512;

export class FrameRate {
  private readonly at_ms = new Float64Array(KEPT);
  private n = 0;

  /** Counts a displayed frame. */
  count(now_ms: number): void {
    this.at_ms[this.n % KEPT] = now_ms;
    this.n += 1;
  }

  /** Frames per second until `now_ms`. */
  rate_hz(now_ms: number): number {
    let [counted, first_ms] = [0, now_ms];
    for (let back = 1; back <= Math.min(this.n, KEPT); back++) {
      const at = this.at_ms[(this.n - back) % KEPT] ?? 0;
      if (now_ms - at > WINDOW_MS) break;
      counted += 1;
      first_ms = at;
    }
    if (counted < 2 && this.n >= 2) return this.slowRate(now_ms);
    // Number of frame periods from the first frame until now, counting half of the current one.
    return counted < 2 ? 0 : (1000 * (counted - 0.5)) / (now_ms - first_ms);
  }

  /** From the interval of the last two frames, or from the time since the last one. */
  private slowRate(now_ms: number): number {
    const last = this.at_ms[(this.n - 1) % KEPT] ?? 0;
    const before = this.at_ms[(this.n - 2) % KEPT] ?? 0;
    return 1000 / Math.max(last - before, now_ms - last);
  }
}
