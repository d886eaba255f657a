/** Report, difference to the active calibration, and activation. */

import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { EVERY_EVENT, useAutoReloaded } from "../../../components/loading/auto_reloaded";
import { Show } from "../../../components/loading/loading";
import { href } from "../../../state/browser/route";
import { text } from "../../../text";
import { Comparison } from "../details/comparison";
import { Facts } from "../details/facts";
import { ActivateButton } from "../overview/activate";
import type { StepProperties } from "./wizard";

export function FinishStep({ calibration_id }: StepProperties) {
  const words = text.value.calibration;
  return (
    <div class="stack">
      <p>{words.finish_lead}</p>
      {calibration_id ? <Decision id={calibration_id} /> : <p class="note">{words.finish_blocked}</p>}
    </div>
  );
}

function Decision({ id }: { id: string }) {
  const { api } = useApp();
  const words = text.value.calibration;
  const { state, reload } = useAutoReloaded(
    async () => ({
      calibration: await data(api.GET("/api/v1/calibrations/{id}", { params: { path: { id } } })),
      active: await data(api.GET("/api/v1/calibrations/active")),
    }),
    EVERY_EVENT,
    [id],
  );
  return (
    <Show of={state}>
      {({ calibration, active }) => {
        const active_id = active.calibration_id ?? undefined;
        // After activation, compare with the previously active calibration.
        const before = active_id === id ? (active.previous_id ?? undefined) : active_id;
        return (
          <>
            <section class="card stack" data-active={active_id === id}>
              <Facts item={calibration} />
              <div class="row">
                {calibration.report && (
                  <a class="button" href={calibration.report} target="_blank" rel="noopener">
                    {words.report}
                  </a>
                )}
                {active_id === id ? (
                  <>
                    <strong>✓ {words.finish_active}</strong>
                    <a class="button" href={href("scan")}>
                      {words.go_scan}
                    </a>
                  </>
                ) : (
                  <ActivateButton item={calibration} reload={reload} primary />
                )}
              </div>
            </section>
            {before && before !== id ? (
              <Comparison key={before} one={before} other={id} />
            ) : (
              <p class="muted">{words.difference_none}</p>
            )}
          </>
        );
      }}
    </Show>
  );
}
