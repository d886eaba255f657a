import { useEffect, useRef } from "preact/hooks";
import { href, PAGES, railEntryOf, route } from "../state/browser/route";
import { digitOf, letter_shortcuts, PAGE_LETTERS } from "../state/browser/shortcuts";
import { text } from "../text";
import { preload } from "./page";

/** Navigation to all pages. */
export function Rail() {
  const { page: shown } = route.value;
  const current = railEntryOf(shown);
  const rail = useRef<HTMLElement>(null);
  // On a phone the rail scrolls sideways.
  useEffect(() => {
    rail.current?.querySelector(`[aria-current]`)?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }, [current]);
  return (
    <nav class="rail" ref={rail} aria-label={text.value.frame.pages}>
      {PAGES.map((page) => (
        <a
          key={page}
          href={href(page)}
          title={[letter_shortcuts.value && `g ${PAGE_LETTERS[page]}`, `Alt + ${digitOf(page)}`]
            .filter(Boolean)
            .join(", ")}
          aria-keyshortcuts={`Alt+${digitOf(page)}`}
          aria-current={page === current ? "page" : undefined}
          onPointerEnter={() => preload(page)}
        >
          {text.value.pages[page]}
        </a>
      ))}
    </nav>
  );
}
