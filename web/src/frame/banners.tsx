/** Banners: a failed Stop, stale data, faults, a stopped station, lost control. */

import type { Station } from "../api/client";
import { useApp } from "../app";
import { ReloadButton } from "../components/loading/reload";
import { ResetButton } from "../components/reset";
import type { Loss } from "../state/station/control";
import { text } from "../text";

export function Banners() {
  const { station, control, stop, stream } = useApp();
  const words = text.value.frame;
  const status = station.status.value;
  const outcome = stop.outcome.value;
  const lost = control.lost.value;
  return (
    <div class="stack banners" aria-live="assertive">
      {(outcome === "no_response" || outcome === "unacknowledged") && (
        <div class="problem banner">
          <strong>{outcome === "no_response" ? words.stop_no_response : words.stop_unacknowledged}</strong>
        </div>
      )}
      {station.stale.value && <div class="note banner">{words.stale_banner}</div>}
      {stream.updated_to.value && (
        <div class="note banner row">
          <span class="grow">{words.updated(stream.updated_to.value)}</span>
          <ReloadButton />
        </div>
      )}
      {lost && (
        <div class="note banner row">
          <span class="grow">{lossText(lost)}</span>
          <button type="button" onClick={() => (control.lost.value = undefined)}>
            {text.value.common.dismiss}
          </button>
        </div>
      )}
      {status && (status.faults.length > 0 || status.state === "Error") && <Faults status={status} />}
      {status?.state === "Halted" && (
        <div class="note banner row">
          <span class="grow">
            {status.laser.light === "not_controlled" ? words.reset_after_stop_lit : words.reset_after_stop}
          </span>
          <ResetButton label={words.reset_stop} />
        </div>
      )}
    </div>
  );
}

function lossText(lost: Loss): string {
  const words = text.value.frame;
  return lost.kind === "taken" ? words.control_taken(lost.by) : words.control_expired[lost.kind];
}

/** A fault in the chosen language if its kind is known, with the server's message, which may contain values. */
function FaultText({ fault }: { fault: Station["faults"][number] }) {
  const words = text.value.frame;
  const known = words.faults[`${fault.device}.${fault.kind}`];
  return (
    <div>
      <strong>
        {words.fault}: {known ? known[0] : <span lang="en">{fault.detail}</span>}
      </strong>
      <div lang={known ? undefined : "en"}>{known ? known[1] : fault.remedy}</div>
      {known && (
        <small class="own-words" lang="en">
          {fault.detail}
        </small>
      )}
    </div>
  );
}

/** The faults with their remedies, and the button that acknowledges them. */
function Faults({ status }: { status: Station }) {
  const words = text.value.frame;
  return (
    <div class="problem banner row">
      <div class="grow">
        {status.faults.map((fault) => (
          <FaultText key={`${fault.device}-${fault.kind}`} fault={fault} />
        ))}
        {status.faults.length === 0 && <strong>{words.states.Error}</strong>}
      </div>
      {status.state === "Error" && <ResetButton label={words.reset} />}
    </div>
  );
}
