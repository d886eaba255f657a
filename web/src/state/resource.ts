/** Data of the server that a page shows: loading, there, or refused with the reason. */

import { signal } from "@preact/signals";
import { type Problem, problemOf } from "../api/client";

export interface Loaded<T> {
  value?: T;
  problem?: Problem;
}

export class Resource<T> {
  readonly state = signal<Loaded<T>>({});
  private asked = 0;

  /** Shows the old value meanwhile, and beside a refusal; an answer that came too late is dropped. */
  async load(read: () => Promise<T>): Promise<void> {
    this.asked += 1;
    const number = this.asked;
    try {
      const value = await read();
      if (this.asked === number) this.state.value = { value };
    } catch (cause) {
      if (this.asked === number) this.state.value = { ...this.state.peek(), problem: problemOf(cause) };
    }
  }

  /** Drops the value, and answers that are still to come. */
  clear(): void {
    this.asked += 1;
    if (Object.keys(this.state.peek()).length > 0) this.state.value = {};
  }
}
