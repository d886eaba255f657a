/** Downloads an image: a new one, or the frozen frame. */

import { useMemo } from "preact/hooks";
import { bytes } from "../../../api/client";
import { CommandButton } from "../../../components/command_button";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import type { LiveView } from "../live_view";

export function Snapshot({ view }: { view: LiveView }) {
  const words = text.value.live;
  const command = useMemo(
    () =>
      new Command(async () => {
        const image = view.frozen.peek() ? view.camera_image.frame : undefined;
        if (image) save(new Blob([image.jpeg]), `frame-${image.sequence}.jpg`);
        else save(await (await bytes("/api/v1/devices/camera/snapshot.jpg")).blob(), `snapshot-${stamp()}.jpg`);
      }),
    [view],
  );
  return <CommandButton command={command}>{view.frozen.value ? words.save_frozen : words.snapshot}</CommandButton>;
}

/** Local time for a file name. */
function stamp(): string {
  const now = new Date(Date.now() - 60_000 * new Date().getTimezoneOffset());
  return now.toISOString().slice(0, 19).replace(/[:]/g, "-");
}

function save(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  URL.revokeObjectURL(address);
}
