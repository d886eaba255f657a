/** Reading values whose shape the compiler cannot know: events of other versions, answers of a proxy. */

/** A field of any value; undefined if it has none of this name. */
export function fieldOf(value: unknown, name: string): unknown {
  return typeof value === "object" && value !== null ? Reflect.get(value, name) : undefined;
}

/** A field with a non-empty text. */
export function textOf(value: unknown, name: string): string | undefined {
  const field = fieldOf(value, name);
  return typeof field === "string" && field !== "" ? field : undefined;
}
