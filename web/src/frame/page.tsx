/** The page of the current route; its code is loaded on first use. */

import { type Signal, signal } from "@preact/signals";
import type { ComponentType } from "preact";
import { type PageName, route } from "../state/browser/route";
import { text } from "../text";
import { ErrorBoundary, Failure } from "./error_boundary";

const PAGE_MODULES: Record<PageName, () => Promise<{ default: ComponentType }>> = {
  operate: () => import("../pages/operate"),
  live: () => import("../pages/live"),
  scan: () => import("../pages/scan"),
  result: () => import("../pages/result"),
  inspections: () => import("../pages/inspections"),
  statistics: () => import("../pages/statistics"),
  studies: () => import("../pages/statistics/studies"),
  teach: () => import("../pages/teach"),
  compare: () => import("../pages/compare"),
  jobs: () => import("../pages/jobs"),
  results: () => import("../pages/results"),
  calibration: () => import("../pages/calibration"),
  health: () => import("../pages/health"),
  settings: () => import("../pages/settings"),
  help: () => import("../pages/help"),
};

interface Loaded {
  component?: ComponentType;
  failure?: unknown;
}

const loaded = new Map<PageName, Signal<Loaded>>();

/** Starts loading a page's code before it is needed. */
export function preload(page: PageName): Signal<Loaded> {
  const known = loaded.get(page);
  if (known && !known.peek().failure) return known;
  const state = known ?? signal<Loaded>({});
  loaded.set(page, state);
  PAGE_MODULES[page]().then(
    (module) => {
      state.value = { component: module.default };
    },
    (failure: unknown) => {
      state.value = { failure };
    },
  );
  return state;
}

export function Page() {
  const { component: Component, failure } = preload(route.value.page).value;
  if (Component) {
    return (
      <ErrorBoundary>
        <Component />
      </ErrorBoundary>
    );
  }
  // A missing file belongs to an older version of the page.
  if (failure) return <Failure title={text.value.frame.page_missing} failure={failure} />;
  return <p class="muted">{text.value.frame.loading}</p>;
}
