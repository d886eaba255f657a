/** Data of the server that a page shows: loading, there, or refused with the reason. */

import { type ReadonlySignal, useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useLayoutEffect } from "preact/hooks";
import { type Problem, problemOf } from "../api/client";
import { text } from "../text";
import { ProblemCard } from "./problem";

export interface Loaded<T> {
  value?: T;
  problem?: Problem;
}

/**
 * Loads what belongs to `inputs`, and forgets it when one of them changes: old values do not stand under new inputs.
 * When one of `occasions` changes it loads again and shows the old value meanwhile. An answer that came too late is
 * dropped.
 */
export function useLoaded<T>(
  load: () => Promise<T>,
  inputs: readonly unknown[],
  occasions: readonly unknown[] = [],
): { state: ReadonlySignal<Loaded<T>>; reload: () => Promise<void> } {
  const state = useSignal<Loaded<T>>({});
  const asked = useSignal(0);
  const reload = async () => {
    asked.value += 1;
    const number = asked.peek();
    try {
      const value = await load();
      if (asked.peek() === number) state.value = { value };
    } catch (cause) {
      if (asked.peek() === number) state.value = { ...state.peek(), problem: problemOf(cause) };
    }
  };
  // Before the browser paints the new inputs.
  useLayoutEffect(() => {
    if (state.peek().value !== undefined || state.peek().problem) state.value = {};
  }, inputs);
  useEffect(() => void reload(), [...inputs, ...occasions]);
  return { state, reload };
}

/** Shows loaded data, or why there are none. */
export function Show<T>(properties: { of: ReadonlySignal<Loaded<T>>; children: (value: T) => ComponentChildren }) {
  const { value, problem } = properties.of.value;
  return (
    <>
      {problem && <ProblemCard problem={problem} />}
      {value !== undefined
        ? properties.children(value)
        : !problem && <p class="muted">{text.value.frame.loading}</p>}
    </>
  );
}
