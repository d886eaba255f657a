/** Signals stored in this browser: user preferences only, nothing that the station depends on. */

import { effect, type Signal, signal } from "@preact/signals";

/** A signal stored in `localStorage` as `sheaf.NAME`; without storage it lasts as long as the page. */
export function remembered(name: string, initial: string): Signal<string>;
export function remembered(name: string, initial: number): Signal<number>;
export function remembered(name: string, initial: boolean): Signal<boolean>;
/** One of `choices`; anything else in the storage is ignored. */
export function remembered<T extends string>(name: string, initial: T, choices: readonly T[]): Signal<T>;
export function remembered<T extends string | number | boolean>(
  name: string,
  initial: T,
  choices?: readonly T[],
): Signal<T> {
  const key = `sheaf.${name}`;
  const stored = read(key);
  const remembered = signal<T>(isOneOf(stored, initial, choices) ? stored : initial);
  effect(() => {
    const text = JSON.stringify(remembered.value);
    try {
      localStorage.setItem(key, text);
    } catch {
      // Storage may be disabled or full; the page works without it.
    }
  });
  return remembered;
}

function read(key: string): unknown {
  try {
    return JSON.parse(localStorage.getItem(key) ?? "null");
  } catch {
    return undefined;
  }
}

/** Whether a stored value is one of the choices; without choices, whether it is of the type of `initial`. */
function isOneOf<T>(stored: unknown, initial: T, choices: readonly T[] | undefined): stored is T {
  return choices ? choices.some((choice) => choice === stored) : typeof stored === typeof initial;
}
