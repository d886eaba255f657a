/** Losses and file of a recording. */

import type { Schemas } from "../../../api/client";

export type Recording = Schemas["RecordingDto"];

/** Exposures that are not in it. */
export function lossesOf({ lost }: Pick<Recording, "lost">): number {
  return lost.camera + lost.incomplete + lost.no_buffer + lost.malformed + lost.recorder;
}

/** Whether its end makes no room on the disk. */
export function nothingFreed(recording: Pick<Recording, "file">): boolean {
  return recording.file == null;
}
