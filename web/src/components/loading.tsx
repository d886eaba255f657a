/** Data of the server within a component. */

import type { ReadonlySignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useLayoutEffect, useMemo } from "preact/hooks";
import { type Loaded, Resource } from "../state/resource";
import { text } from "../text";
import { ProblemCard } from "./problem";

/**
 * Loads what belongs to `inputs`, and drops it when one of them changes: old values do not stand under new inputs.
 * When one of `occasions` changes it loads again and shows the old value meanwhile.
 */
export function useLoaded<T>(
  load: () => Promise<T>,
  inputs: readonly unknown[],
  occasions: readonly unknown[] = [],
): { state: ReadonlySignal<Loaded<T>>; reload: () => Promise<void> } {
  const resource = useMemo(() => new Resource<T>(), []);
  const reload = () => resource.load(load);
  // Before the browser paints the new inputs.
  useLayoutEffect(() => resource.clear(), inputs);
  useEffect(() => void reload(), [...inputs, ...occasions]);
  return { state: resource.state, reload };
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
