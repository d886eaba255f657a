/** Losses and file of a recording. */

import type { Schemas } from "../../../api/client";

export type Recording = Schemas["RecordingDto"];

/** Number of frames missing from a recording. */
export function lossesOf({ lost }: Pick<Recording, "lost">): number {
  return lost.camera + lost.incomplete + lost.no_buffer + lost.malformed + lost.recorder;
}

/** Whether deleting the recording frees no disk space. */
export function nothingFreed(recording: Pick<Recording, "file">): boolean {
  return recording.file == null;
}
