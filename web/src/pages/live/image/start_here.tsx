/** Over the empty image: why there is none, and the button that starts the live view. */

import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { useBlocked } from "../../../components/station/blocked";
import { text } from "../../../text";
import { useLiveCommands } from "../live_commands";
import type { LiveView } from "../live_view";

export function StartHere({ view }: { view: LiveView }) {
  const { station } = useApp();
  const { start } = useLiveCommands();
  const blocked = useBlocked();
  const words = text.value.live;
  const running = station.status.value?.state === "Operational.ContinuousExecution";
  const watching = running || station.busy.value;
  if (view.frozen.value || (view.values.value && watching)) return null;
  if (watching) return <p class="start-here">{words.first_frame}</p>;
  const over_image = view.values.value !== undefined;
  return (
    <div class={over_image ? "start-here over" : "start-here"}>
      <strong>{over_image ? words.ended : words.off}</strong>
      {!over_image && <p>{words.off_hint}</p>}
      <CommandButton command={start} kind="primary" blocked={blocked}>
        {words.start}
      </CommandButton>
    </div>
  );
}

/** Over the empty plot: why there is no profile. */
export function NoProfile({ view }: { view: LiveView }) {
  const words = text.value.live;
  if (view.has_profile.value) return null;
  const values = view.values.value;
  const why = !values
    ? words.profile_here
    : values.calibrated
      ? words.no_profile
      : words.profile_needs_calibration;
  return <p class="start-here cover">{why}</p>;
}
