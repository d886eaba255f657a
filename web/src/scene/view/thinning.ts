/**
 * Level of detail: reduces the number of points drawn while the view moves or the cloud grows, to keep the frame rate.
 *
 * GPU time can be observed only as the delay of the next frame. A late frame halves the number of points, a series of
 * frames in time doubles it; a view at rest is drawn completely.
 */

/** A frame later than this is late: 30 frames per second. */
const LATE_MS = 34;

/** Number of frames in time before the number of points is doubled. */
const IN_TIME_FRAMES = 20;

/** Maximum number of points at the start of a movement, suitable for a slow GPU. */
const BEGIN_POINTS = 2_000_000;

export class Thinning {
  /** Factor by which the number of points is reduced; a power of two. */
  factor = 1;
  private in_time = 0;

  constructor(private readonly coarsest: number) {}

  /** Called when a movement starts. */
  begin(n_points: number): void {
    while (this.factor < this.coarsest && n_points / this.factor > BEGIN_POINTS) this.factor *= 2;
  }

  /** Called for every frame. */
  frame(since_last_ms: number): void {
    if (since_last_ms > LATE_MS) {
      this.in_time = 0;
      this.factor = Math.min(this.coarsest, 2 * this.factor);
      return;
    }
    this.in_time += 1;
    if (this.in_time < IN_TIME_FRAMES) return;
    this.in_time = 0;
    this.factor = Math.max(1, this.factor / 2);
  }

  /** Called when the view is at rest. */
  rest(): void {
    this.in_time = 0;
    this.factor = 1;
  }
}
