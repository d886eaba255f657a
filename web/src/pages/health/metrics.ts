/** Numbers of `GET /metrics` that the page shows. */

/** Parses the Prometheus text format; labels stay part of the name, histogram buckets are omitted. */
export function parseMetrics(text: string): ReadonlyMap<string, number> {
  const numbers = new Map<string, number>();
  for (const line of text.split("\n")) {
    if (line.startsWith("#") || line.includes("_bucket{")) continue;
    const at = line.lastIndexOf(" ");
    const value = Number(line.slice(at + 1));
    if (at > 0 && Number.isFinite(value)) numbers.set(line.slice(0, at), value);
  }
  return numbers;
}
