/** Where in the station the person is: `#/scan/ID?…`, so that a place can be linked and the server stays static. */

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

/** Pages that belong to one in the rail: one scan; the inspections, or one of them. */
export const PARENTS = { result: "results", inspections: "results" } as const;

export type PageName = (typeof PAGES)[number] | keyof typeof PARENTS;

export interface Route {
  page: PageName;
  /** What the page shows: the id of a scan, a session, a calibration, an inspection. */
  id: string | undefined;
  query: URLSearchParams;
}

export function parseRoute(hash: string): Route {
  const [path = "", query = ""] = hash.replace(/^#?\/?/, "").split("?");
  const [page = "", id] = path.split("/").map(decodeURIComponent);
  const known = [...PAGES, ...Object.keys(PARENTS)].includes(page);
  return { page: known ? (page as PageName) : "operate", id: id || undefined, query: new URLSearchParams(query) };
}

export function href(page: PageName, id?: string, query?: Record<string, string>): string {
  const search = query ? `?${new URLSearchParams(query)}` : "";
  return `#/${page}${id ? `/${encodeURIComponent(id)}` : ""}${search}`;
}

export const route = signal(parseRoute(typeof location === "undefined" ? "" : location.hash));

/** Goes to a page. */
export function goTo(page: PageName, id?: string, query?: Record<string, string>): void {
  location.hash = href(page, id, query);
}

/** Changes the query of a page in place: going back leads to the page before it. */
export function replaceQuery(page: PageName, id: string | undefined, query: Record<string, string>): void {
  const hash = Object.keys(query).length > 0 ? href(page, id, query) : href(page, id);
  if (hash !== location.hash) location.replace(hash);
}

export function followRoute(): void {
  addEventListener("hashchange", () => {
    route.value = parseRoute(location.hash);
  });
}
