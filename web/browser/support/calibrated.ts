/** Before the first file: calibrates a station once, of whose data every file that asks for it gets a copy. */

import type { TestProject } from "vitest/node";
import { Server } from "./server";

export default async function setup({ provide }: TestProject): Promise<() => Promise<void>> {
  const server = await Server.start();
  await server.calibrate();
  await server.terminate();
  provide("calibrated", server.folder);
  return async () => await server.stop();
}
