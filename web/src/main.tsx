/** Creates the services of the page and connects them. */

import { effect } from "@preact/signals";
import { render } from "preact";
import { type Api, makeApi, postStop } from "./api/client";
import { AppContext } from "./app";
import { Frame } from "./frame/frame";
import { followRoute } from "./state/browser/route";
import { followShortcuts } from "./state/browser/shortcuts";
import { theme } from "./state/browser/theme";
import { EventLog } from "./state/records/events";
import { JobsState } from "./state/records/jobs";
import { Control } from "./state/station/control";
import { StationState } from "./state/station/station";
import { Stop } from "./state/station/stop";
import { StreamConnection } from "./stream/connection";
import { language } from "./text";
import "./theme.css";

const stream = new StreamConnection(`${location.origin.replace(/^http/, "ws")}/api/v1/stream`);
const station = new StationState(stream);
const control: Control = new Control(station, (): Api => api);
const api = makeApi(
  () => control.id(),
  () => control.name,
);
const stop = new Stop(
  stream,
  station,
  (abort) => postStop(control.name, abort),
  () => control.name,
);
const jobs = new JobsState(stream, api);
const events = new EventLog(stream, api);

effect(() => {
  document.documentElement.lang = language.value;
  document.documentElement.dataset.theme = theme.value;
});
// Print in the light theme.
addEventListener("beforeprint", () => {
  document.documentElement.dataset.theme = "light";
});
addEventListener("afterprint", () => {
  document.documentElement.dataset.theme = theme.peek();
});
const watchVisibility = () => stream.setVisible(document.visibilityState !== "hidden");
document.addEventListener("visibilitychange", watchVisibility);
watchVisibility();
followRoute();
followShortcuts();
station.start();
control.start();
jobs.start();
events.start();
stream.start();

const root = document.getElementById("app");
if (root) {
  render(
    <AppContext.Provider value={{ api, stream, station, stop, control, jobs, events }}>
      <Frame />
    </AppContext.Provider>,
    root,
  );
}
