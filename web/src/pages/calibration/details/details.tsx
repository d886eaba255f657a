/** All results of one calibration. */

import { useEffect, useRef } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { Show, useLoaded } from "../../../components/loading/loading";
import { href } from "../../../state/browser/route";
import { text } from "../../../text";
import { AxisView } from "./axis_view";
import { Facts } from "./facts";
import { AnglesView, ModelsView } from "./models_view";
import { Reports } from "./reports";
import { ResidualsView } from "./residuals_view";
import { StageView } from "./stage_view";

/** Loads a calibration with its document; calibrations never change. */
export function useCalibration(id: string) {
  const { api } = useApp();
  return useLoaded(() => data(api.GET("/api/v1/calibrations/{id}", { params: { path: { id } } })), [api, id]);
}

export function Details({ id }: { id: string }) {
  const words = text.value.calibration;
  const { state } = useCalibration(id);
  const section = useRef<HTMLElement>(null);
  const is_loaded = state.value.value !== undefined;
  useEffect(() => {
    if (is_loaded) section.current?.scrollIntoView({ block: "start" });
  }, [is_loaded]);
  return (
    <section class="card stack details" ref={section} data-details={id} aria-label={words.details}>
      <div class="row">
        <h2 class="grow">
          {words.details} <span class="mono">{id}</span>
        </h2>
        <a class="button" href={href("calibration")}>
          {text.value.common.close}
        </a>
      </div>
      <Show of={state}>
        {(calibration) => {
          const [summary, document] = [calibration.summary, calibration.calibration];
          return (
            <>
              <Facts item={calibration} />
              <Reports id={id} />
              {[...summary.warnings, ...summary.left_out].map((warning) => (
                <div class="note" key={warning} lang="en">
                  {warning}
                </div>
              ))}
              <ModelsView summary={summary} />
              <AnglesView document={document} />
              <ResidualsView id={id} document={document} />
              {summary.axis && (
                <section>
                  <h3>{words.step_names.stage}</h3>
                  <AxisView axis={summary.axis} />
                </section>
              )}
              {summary.stage && (
                <section>
                  <h3>{words.step_names.stage}</h3>
                  <StageView stage={summary.stage} />
                </section>
              )}
            </>
          );
        }}
      </Show>
    </section>
  );
}
