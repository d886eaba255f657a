/** The route in the URL hash, `#/scan/ID?…`, so that views can be linked without routing on the server. */

import { signal } from "@preact/signals";

export const PAGES = [
  "operate",
  "live",
  "scan",
  "jobs",
  "results",
  "calibration",
  "health",
  "settings",
  "help",
] as const;

/** Pages without an entry in the rail, and the entry that they belong to. */
const PARENTS = {
  result: "results",
  inspections: "results",
  statistics: "results",
  teach: "results",
  compare: "results",
  studies: "health",
} as const;

export type PageName = (typeof PAGES)[number] | keyof typeof PARENTS;

const PAGE_NAMES: readonly PageName[] = [
  ...PAGES,
  "result",
  "inspections",
  "statistics",
  "teach",
  "compare",
  "studies",
];

function hasParent(page: PageName): page is keyof typeof PARENTS {
  return page in PARENTS;
}

/** The entry of the rail to which a page belongs. */
export function railEntryOf(page: PageName): (typeof PAGES)[number] {
  return hasParent(page) ? PARENTS[page] : page;
}

export interface Route {
  page: PageName;
  /** The id of the scan, session, calibration or inspection that the page shows. */
  id: string | undefined;
  query: URLSearchParams;
}

export function parseRoute(hash: string): Route {
  const [path = "", query = ""] = hash.replace(/^#?\/?/, "").split("?");
  const [page = "", id] = path.split("/").map(decodeURIComponent);
  const known = PAGE_NAMES.find((name) => name === page);
  return { page: known ?? "operate", id: id || undefined, query: new URLSearchParams(query) };
}

export function href(page: PageName, id?: string, query?: Record<string, string>): string {
  const search = query ? `?${new URLSearchParams(query)}` : "";
  return `#/${page}${id ? `/${encodeURIComponent(id)}` : ""}${search}`;
}

export const route = signal(parseRoute(typeof location === "undefined" ? "" : location.hash));

/** Navigates to a page. */
export function goTo(page: PageName, id?: string, query?: Record<string, string>): void {
  location.hash = href(page, id, query);
}

/** Replaces the query without a new history entry; at once, so that the next change starts from this one. */
export function replaceQuery(page: PageName, id: string | undefined, query: Record<string, string>): void {
  const hash = Object.keys(query).length > 0 ? href(page, id, query) : href(page, id);
  if (hash === location.hash) return;
  location.replace(hash);
  route.value = parseRoute(hash);
}

export function followRoute(): void {
  addEventListener("hashchange", () => {
    route.value = parseRoute(location.hash);
  });
}
