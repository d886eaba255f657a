/** Server data: loading, loaded, or failed with a problem. */

import { signal } from "@preact/signals";
import { type Problem, problemOf } from "../api/client";

export interface Loaded<T> {
  value?: T;
  problem?: Problem;
}

export class Resource<T> {
  readonly state = signal<Loaded<T>>({});
  private n_requests = 0;

  /** Loads; keeps the old value meanwhile and after a failure; discards outdated responses. */
  async load(read: () => Promise<T>): Promise<void> {
    this.n_requests += 1;
    const request = this.n_requests;
    try {
      const value = await read();
      if (this.n_requests === request) this.state.value = { value };
    } catch (cause) {
      if (this.n_requests === request) this.state.value = { ...this.state.peek(), problem: problemOf(cause) };
    }
  }

  /** Clears the value and ignores pending responses. */
  clear(): void {
    this.n_requests += 1;
    if (Object.keys(this.state.peek()).length > 0) this.state.value = {};
  }
}
