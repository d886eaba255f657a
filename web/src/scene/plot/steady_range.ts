/** Range of an axis that follows the data without jitter. */

/** Margin on either side of the data, share of their span. */
const MARGIN = 0.06;

/** The range shrinks when the data fill less than this share of it. */
const SHRINKS_BELOW = 0.55;

export class SteadyRange {
  private range: readonly [number, number] | undefined;

  /** `least`: the smallest span, so that noise alone does not fill the plot. */
  constructor(private readonly least: number) {}

  get value(): readonly [number, number] | undefined {
    return this.range;
  }

  /** Adapts the range to the extent of new data; returns whether it changed. */
  follow(min: number, max: number): boolean {
    if (!(max >= min)) return false;
    const span = Math.max(max - min, this.least);
    if (this.range) {
      const [low, high] = this.range;
      if (min >= low && max <= high && span > SHRINKS_BELOW * (high - low)) return false;
    }
    const middle = (min + max) / 2;
    const half = span * (0.5 + MARGIN);
    this.range = [middle - half, middle + half];
    return true;
  }
}
