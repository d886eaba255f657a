/** The two lists of results: all scans, and the inspections. */

import { href } from "../state/browser/route";
import { text } from "../text";

export function ResultViews({ current }: { current: "results" | "inspections" }) {
  const words = text.value.inspections;
  const names = { results: words.scans, inspections: words.title };
  return (
    <nav class="row views" aria-label={words.views}>
      {(["results", "inspections"] as const).map((page) => (
        <a key={page} class="button" href={href(page)} aria-current={page === current ? "page" : undefined}>
          {names[page]}
        </a>
      ))}
    </nav>
  );
}
