/** The number fields that belong together: commands that depend on them wait until each holds an allowed number. */

import { computed, signal } from "@preact/signals";
import { useMemo } from "preact/hooks";

export class Form {
  private readonly wrong = signal<ReadonlyMap<string, string>>(new Map());
  private readonly typing = signal<ReadonlySet<string>>(new Set());
  /** Whether a field holds an allowed number that becomes its value as soon as the field is left. */
  readonly pending = computed(() => this.typing.value.size > 0);
  /** Grows when all fields are to show their values again. */
  readonly restored = signal(0);
  /** What is wrong with the first wrong field, in words; `undefined` if all are right. */
  readonly blocked = computed(() => this.wrong.value.values().next().value);

  /** Notes what is wrong with a field (`undefined`: nothing), and whether it holds a number that is no value yet. */
  note(field: string, wrong: string | undefined, typing = false): void {
    if (this.typing.peek().has(field) !== typing) {
      const others = [...this.typing.peek()].filter((name) => name !== field);
      this.typing.value = new Set(typing ? [...others, field] : others);
    }
    if (this.wrong.peek().get(field) === wrong) return;
    const others = [...this.wrong.peek()].filter(([name]) => name !== field);
    this.wrong.value = new Map(wrong === undefined ? others : [...others, [field, wrong]]);
  }

  /** Discards input that is not a value yet. */
  restore(): void {
    this.restored.value += 1;
  }
}

export function useForm(): Form {
  return useMemo(() => new Form(), []);
}
