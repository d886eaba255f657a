/** Loading server data in a component. */

import type { ReadonlySignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useLayoutEffect, useMemo } from "preact/hooks";
import { type Loaded, Resource } from "../../state/resource";
import { text } from "../../text";
import { ProblemCard } from "../problem";

/**
 * Loads data for `inputs`; a change of `inputs` discards the old value and loads again.
 * A change of `occasions` loads again and keeps the old value meanwhile.
 */
export function useLoaded<T>(
  load: () => Promise<T>,
  inputs: readonly unknown[],
  occasions: readonly unknown[] = [],
): { state: ReadonlySignal<Loaded<T>>; reload: () => Promise<void> } {
  const resource = useMemo(() => new Resource<T>(), []);
  const reload = () => resource.load(load);
  // Runs before the browser paints the new inputs.
  useLayoutEffect(() => resource.clear(), inputs);
  useEffect(() => void reload(), [...inputs, ...occasions]);
  return { state: resource.state, reload };
}

/** Renders loaded data, a loading message, or the problem. */
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
