/**
 * How much of a cloud is drawn while it moves or grows: as much as keeps the pace.
 *
 * The time of the graphics card shows only in how late the next frame comes. Frames that come late thin the cloud to
 * half, a row of frames in time brings half of it back; a view that rests is drawn in full.
 */

/** A frame later than this is late: 30 images per second. */
const LATE_MS = 34;

/** So many frames in time before more is drawn again. */
const IN_TIME_FRAMES = 20;

/** Points that a moving view begins with at most; weak graphics draw so many in time. */
const BEGIN_POINTS = 2_000_000;

export class Thinning {
  /** One point in so many is drawn; a power of two. */
  thinning = 1;
  private in_time = 0;

  constructor(private readonly coarsest: number) {}

  /** A movement of a cloud of so many points begins. */
  begin(n_points: number): void {
    while (this.thinning < this.coarsest && n_points / this.thinning > BEGIN_POINTS) this.thinning *= 2;
  }

  /** A frame came so long after the one before. */
  frame(since_last_ms: number): void {
    if (since_last_ms > LATE_MS) {
      this.in_time = 0;
      this.thinning = Math.min(this.coarsest, 2 * this.thinning);
      return;
    }
    this.in_time += 1;
    if (this.in_time < IN_TIME_FRAMES) return;
    this.in_time = 0;
    this.thinning = Math.max(1, this.thinning / 2);
  }

  /** The view rests. */
  rest(): void {
    this.in_time = 0;
    this.thinning = 1;
  }
}
