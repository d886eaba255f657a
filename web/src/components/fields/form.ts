/** The number fields of a form; its commands are blocked while any field is invalid. */

import { computed, signal } from "@preact/signals";
import { useMemo } from "preact/hooks";

export class Form {
  private readonly wrong = signal<ReadonlyMap<string, string>>(new Map());
  private readonly typing = signal<ReadonlySet<string>>(new Set());
  /** Whether a field holds a valid number that is not committed yet. */
  readonly pending = computed(() => this.typing.value.size > 0);
  /** Incremented to make all fields show their committed values again. */
  readonly restored = signal(0);
  /** Error message of the first invalid field; `undefined` if all are valid. */
  readonly blocked = computed(() => this.wrong.value.values().next().value);

  /** Sets the error message of a field (`undefined`: valid), and whether it holds an uncommitted number. */
  note(field: string, wrong: string | undefined, typing = false): void {
    if (this.typing.peek().has(field) !== typing) {
      const others = [...this.typing.peek()].filter((name) => name !== field);
      this.typing.value = new Set(typing ? [...others, field] : others);
    }
    if (this.wrong.peek().get(field) === wrong) return;
    const others = [...this.wrong.peek()].filter(([name]) => name !== field);
    this.wrong.value = new Map(wrong === undefined ? others : [...others, [field, wrong]]);
  }

  /** Discards uncommitted input. */
  restore(): void {
    this.restored.value += 1;
  }
}

export function useForm(): Form {
  return useMemo(() => new Form(), []);
}
