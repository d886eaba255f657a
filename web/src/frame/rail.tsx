import { href, PAGES, route } from "../state/route";
import { text } from "../text";
import { preload } from "./page";

/** The way to all pages. A result belongs to the results. */
export function Rail() {
  const current = route.value.page === "result" ? "results" : route.value.page;
  return (
    <nav class="rail" aria-label={text.value.frame.pages}>
      {PAGES.map((page) => (
        <a
          key={page}
          href={href(page)}
          aria-current={page === current ? "page" : undefined}
          onPointerEnter={() => preload(page)}
        >
          {text.value.pages[page]}
        </a>
      ))}
    </nav>
  );
}
