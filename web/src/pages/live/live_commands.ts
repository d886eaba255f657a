/** Commands that start and end the live view, shared by all buttons. */

import { useMemo } from "preact/hooks";
import { data } from "../../api/client";
import { type App, useApp } from "../../app";
import { remembered } from "../../state/browser/remembered";
import { Command } from "../../state/station/command";

/** Relative laser power at the start of the live view, 0 to 1. */
export const laser_power = remembered("live.laser_power", 1);

export interface LiveCommands {
  start: Command;
  end: Command;
}

const made = new WeakMap<App, LiveCommands>();

export function useLiveCommands(): LiveCommands {
  const app = useApp();
  return useMemo(() => {
    const commands = made.get(app) ?? makeCommands(app);
    made.set(app, commands);
    return commands;
  }, [app]);
}

function makeCommands({ api, control }: App): LiveCommands {
  const put = async (running: boolean) => {
    await control.ensure();
    const params = { header: { "Sheaf-Control": control.id() ?? "" } };
    const body = running ? { running, laser_power: laser_power.peek() } : { running };
    await data(api.PUT("/api/v1/station/live", { params, body }));
  };
  return { start: new Command(() => put(true)), end: new Command(() => put(false)) };
}
