/** Keyboard shortcuts to pages: `g` and a letter, or Alt and a digit. */

import { remembered } from "./remembered";
import { goTo, PAGES, type PageName } from "./route";

/** Whether single letters are shortcuts; can be turned off for speech input and barcode scanners. */
export const letter_shortcuts = remembered("letter_shortcuts", true);

/** The letter after `g`. */
export const PAGE_LETTERS: Record<(typeof PAGES)[number], string> = {
  operate: "o",
  live: "l",
  scan: "s",
  jobs: "j",
  results: "r",
  calibration: "c",
  health: "h",
  settings: "e",
  help: "p",
};

/** Maximum time between the two letters, by event time even if a busy page processes them late. */
const SECOND_WITHIN_MS = 1500;

/** The digit that opens a page together with Alt. */
export function digitOf(page: (typeof PAGES)[number]): string {
  return `${PAGES.indexOf(page) + 1}`;
}

export interface Key {
  key: string;
  /** Physical key: on some layouts Alt changes the character of digit keys. */
  code: string;
  altKey: boolean;
  ctrlKey: boolean;
  metaKey: boolean;
}

/** Recognizes shortcuts in a sequence of key events. */
export class Shortcuts {
  private g_at_ms = Number.NEGATIVE_INFINITY;

  /**
   * The target of a key: a page, the list of shortcuts, or none. `letters`: whether letter shortcuts are enabled
   * here.
   */
  follow(key: Key, letters: boolean, at_ms: number): PageName | "shortcuts" | undefined {
    if (key.ctrlKey || key.metaKey) return undefined;
    if (key.altKey) return PAGES[Number(/^Digit([1-9])$/.exec(key.code)?.[1] ?? 0) - 1];
    if (!letters) return undefined;
    if (key.key === "?") return "shortcuts";
    const after_g = at_ms - this.g_at_ms < SECOND_WITHIN_MS;
    this.g_at_ms = key.key === "g" ? at_ms : Number.NEGATIVE_INFINITY;
    return after_g ? PAGES.find((page) => PAGE_LETTERS[page] === key.key) : undefined;
  }
}

/** Whether the target of a key event is an input. */
function isTyping(target: EventTarget | null): boolean {
  return target instanceof Element && target.closest("input, select, textarea, [contenteditable]") !== null;
}

/** Installs the shortcuts for the whole page. */
export function followShortcuts(): void {
  const shortcuts = new Shortcuts();
  addEventListener("keydown", (event) => {
    if (document.querySelector("dialog[open]")) return;
    const letters = letter_shortcuts.value && !isTyping(event.target);
    const to = shortcuts.follow(event, letters, event.timeStamp);
    if (!to) return;
    event.preventDefault();
    if (to === "shortcuts") goTo("help", "shortcuts");
    else goTo(to);
    // Tab continues in the new page; pages with a first field set the focus themselves.
    document.getElementById("page")?.focus();
  });
}
