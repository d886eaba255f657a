/** The page of the route; its code is loaded when it is first wanted. */

import { type Signal, signal } from "@preact/signals";
import type { ComponentType } from "preact";
import { type PageName, route } from "../state/browser/route";
import { text } from "../text";
import { Boundary, Failure } from "./boundary";

type Panel = ComponentType;

const PANELS: Record<PageName, () => Promise<{ default: Panel }>> = {
  operate: () => import("../panels/operate"),
  live: () => import("../panels/live"),
  scan: () => import("../panels/scan"),
  result: () => import("../panels/result"),
  inspections: () => import("../panels/inspections"),
  jobs: () => import("../panels/jobs"),
  results: () => import("../panels/results"),
  calibration: () => import("../panels/calibration"),
  health: () => import("../panels/health"),
  settings: () => import("../panels/settings"),
  help: () => import("../panels/help"),
};

interface Loaded {
  panel?: Panel;
  failure?: unknown;
}

const loaded = new Map<PageName, Signal<Loaded>>();

/** Begins to load a page, so that it is there when it is wanted. */
export function preload(page: PageName): Signal<Loaded> {
  const known = loaded.get(page);
  if (known && !known.peek().failure) return known;
  const state = known ?? signal<Loaded>({});
  loaded.set(page, state);
  PANELS[page]().then(
    (module) => {
      state.value = { panel: module.default };
    },
    (failure: unknown) => {
      state.value = { failure };
    },
  );
  return state;
}

export function Page() {
  const { panel: Panel, failure } = preload(route.value.page).value;
  if (Panel) {
    return (
      <Boundary>
        <Panel />
      </Boundary>
    );
  }
  // A file that is gone is one of an older version of this page.
  if (failure) return <Failure title={text.value.frame.page_missing} failure={failure} />;
  return <p class="muted">{text.value.frame.loading}</p>;
}
