/** The services of the page, created once in `main.tsx` and passed to components by context. */

import { createContext } from "preact";
import { useContext } from "preact/hooks";
import type { Api } from "./api/client";
import type { EventLog } from "./state/records/events";
import type { JobsState } from "./state/records/jobs";
import type { Control } from "./state/station/control";
import type { StationState } from "./state/station/station";
import type { Stop } from "./state/station/stop";
import type { StreamConnection } from "./stream/connection";

export interface App {
  api: Api;
  stream: StreamConnection;
  station: StationState;
  stop: Stop;
  control: Control;
  jobs: JobsState;
  events: EventLog;
}

export const AppContext = createContext<App | undefined>(undefined);

/** The services, inside a component. */
export function useApp(): App {
  const app = useContext(AppContext);
  if (!app) throw new Error("a component was rendered outside the app context");
  return app;
}
