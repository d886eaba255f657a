/** Typed values of select elements. */

/** The selected value of a select element; undefined if it is not one of `options`. */
export function selected<T extends string>(
  event: { currentTarget: HTMLSelectElement },
  options: readonly T[],
): T | undefined {
  return options.find((option) => option === event.currentTarget.value);
}
