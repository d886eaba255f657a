/** What a person must know before anything else: a Stop that failed, old data, faults, a stopped station, lost control. */

import type { Station } from "../api/client";
import { useApp } from "../app";
import { ResetButton } from "../parts/reset";
import { text } from "../text";
import { stop_outcome } from "./stop";

export function Banners() {
  const { station, control } = useApp();
  const words = text.value.frame;
  const status = station.status.value;
  const outcome = stop_outcome.value;
  return (
    <div class="stack banners" aria-live="assertive">
      {(outcome === "not_reached" || outcome === "not_told") && (
        <div class="problem banner">
          <strong>{outcome === "not_reached" ? words.not_stopped : words.stopped_untold}</strong>
        </div>
      )}
      {station.stale.value && <div class="note banner">{words.stale_banner(station.stale_s.value)}</div>}
      {control.lost_to.value !== undefined && (
        <div class="note banner row">
          <span class="grow">{words.control_lost(control.lost_to.value)}</span>
          <button type="button" onClick={() => (control.lost_to.value = undefined)}>
            {text.value.parts.dismiss}
          </button>
        </div>
      )}
      {status && (status.faults.length > 0 || status.state === "Error") && <Faults status={status} />}
      {status?.state === "Halted" && (
        <div class="note banner row">
          <span class="grow">{words.reset_after_stop}</span>
          <ResetButton label={words.reset_stop} />
        </div>
      )}
    </div>
  );
}

/** What failed, what to do about it, and the word that it is done. */
function Faults({ status }: { status: Station }) {
  const words = text.value.frame;
  return (
    <div class="problem banner row">
      <div class="grow">
        {status.faults.map((fault) => (
          <div key={`${fault.device}-${fault.kind}`}>
            <strong>
              {words.fault}: <span lang="en">{fault.detail}</span>
            </strong>
            <div lang="en">{fault.remedy}</div>
          </div>
        ))}
        {status.faults.length === 0 && <strong>{words.states.Error}</strong>}
      </div>
      {status.state === "Error" && <ResetButton label={words.reset} />}
    </div>
  );
}
