/** What a person must know before anything else: a Stop that failed, old data, faults, a stopped station, lost control. */

import type { Station } from "../api/client";
import { useApp } from "../app";
import { ResetButton } from "../parts/reset";
import type { Loss } from "../state/control";
import { text } from "../text";

export function Banners() {
  const { station, control, stop } = useApp();
  const words = text.value.frame;
  const status = station.status.value;
  const outcome = stop.outcome.value;
  const lost = control.lost.value;
  return (
    <div class="stack banners" aria-live="assertive">
      {(outcome === "unanswered" || outcome === "unacknowledged") && (
        <div class="problem banner">
          <strong>{outcome === "unanswered" ? words.stop_unanswered : words.stop_unacknowledged}</strong>
        </div>
      )}
      {station.stale.value && <div class="note banner">{words.stale_banner}</div>}
      {lost && (
        <div class="note banner row">
          <span class="grow">{lossWords(lost)}</span>
          <button type="button" onClick={() => (control.lost.value = undefined)}>
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

function lossWords(lost: Loss): string {
  const words = text.value.frame;
  return lost.kind === "taken" ? words.control_taken(lost.by) : words.control_expired[lost.kind];
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
