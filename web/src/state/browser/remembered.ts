/** Signals stored in this browser: user preferences only, nothing that the station depends on. */

import { effect, type Signal, signal } from "@preact/signals";

/** A signal stored in `localStorage` as `sheaf.NAME`; without storage it lasts as long as the page. */
export function remembered(name: string, initial: string): Signal<string>;
export function remembered(name: string, initial: number): Signal<number>;
export function remembered(name: string, initial: boolean): Signal<boolean>;
export function remembered<T extends string | number | boolean>(name: string, initial: T): Signal<T>;
export function remembered<T extends string | number | boolean>(name: string, initial: T): Signal<T> {
  const key = `sheaf.${name}`;
  const remembered = signal<T>(read(key, initial));
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

function read<T extends string | number | boolean>(key: string, initial: T): T {
  try {
    const known: unknown = JSON.parse(localStorage.getItem(key) ?? "null");
    return typeof known === typeof initial ? (known as T) : initial;
  } catch {
    return initial;
  }
}
