/** The window title, which shows the state of the station in the browser's tab. */

import type { PageName } from "../state/browser/route";
import type { Catalogue } from "../text/en";

export function titleOf(words: Catalogue, page: PageName, state: string | undefined, stale: boolean): string {
  const condition = stale ? words.frame.title_stale : state && (words.frame.states[state] ?? state);
  return [condition, words.pages[page], "Sheaf"].filter(Boolean).join(" · ");
}
