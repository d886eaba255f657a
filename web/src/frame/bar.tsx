/** The top bar: simulation mark, state, laser, interlock, connection, control, Stop. */

import { useApp } from "../app";
import { activityOf } from "../components/job/job_text";
import { text } from "../text";
import { ControlButton } from "./control_button";
import { StopButton } from "./stop";

export function Bar() {
  const { station, jobs } = useApp();
  const words = text.value.frame;
  const status = station.status.value;
  const simulated = station.simulated.value;
  const working = status?.job_id != null;
  const interlock = status?.laser.interlock_closed;
  return (
    <header class="bar">
      {simulated && (
        <span class="simulated-word" title={words.simulated_hint}>
          {words.simulated[simulated] ?? simulated}
        </span>
      )}
      <span class={`item state ${status?.state === "Error" ? "abnormal" : ""}`} title={status?.state}>
        <strong>{status ? (words.states[status.state] ?? status.state_label) : words.loading}</strong>
        <small>{working ? activityOf(status, jobs.get(status.job_id ?? "")) : (status?.state ?? "–")}</small>
      </span>
      <span class="lights">
        <span class="item laser">
          <small>{words.laser}</small>
          <strong
            class={status?.laser.light === "on" || status?.laser.light === "not_controlled" ? "lit" : undefined}
          >
            {words.light[status?.laser.light ?? "unknown"]}
          </strong>
        </span>
        <span class={`item interlock ${interlock === false ? "abnormal" : ""}`}>
          <small>{words.interlock}</small>
          <strong>
            {interlock == null
              ? words.interlock_unknown
              : interlock
                ? words.interlock_closed
                : words.interlock_open}
          </strong>
        </span>
      </span>
      <span class={`item link ${station.stale.value ? "abnormal" : ""}`} role="status">
        <small>{words.link}</small>
        <strong>
          {station.stale.value ? words.link_stale : words.link_live}
          {/* Hidden from screen readers, which would announce it every second. */}
          {station.stale.value && <span aria-hidden="true"> {station.stale_s.value} s</span>}
        </strong>
      </span>
      <span class="spacer" />
      <ControlButton />
      <StopButton />
    </header>
  );
}
