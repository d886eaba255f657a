/** Re-evaluates an inspection with another version of its recipe or another calibration. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, idempotencyKey } from "../../api/client";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { Choice, storedOption } from "../../components/fields/choice";
import { succeeded } from "../../components/job/job_problem";
import { Show, useLoaded } from "../../components/loading/loading";
import { goTo } from "../../state/browser/route";
import { type Inspection, versionName } from "../../state/records/inspections";
import { Command } from "../../state/station/command";
import { text } from "../../text";

export function ReEvaluate({ inspection }: { inspection: Inspection }) {
  const { api, jobs } = useApp();
  const words = text.value.inspections;
  const { recipe } = inspection;
  const versions = useLoaded(
    () => data(api.GET("/api/v1/recipes/{id}/versions", { params: { path: { id: recipe.id } } })),
    [api, recipe.id],
  );
  const calibrations = useLoaded(
    async () => (await data(api.GET("/api/v1/calibrations", { params: { query: { limit: 50 } } }))).items,
    [api],
  );
  /** Undefined: that of the point cloud. */
  const calibration = useSignal<string | undefined>(undefined);
  /** Undefined: the newest. */
  const chosen = useSignal<number | undefined>(undefined);
  const run = useMemo(
    () =>
      new Command(async (steps) => {
        const version = chosen.peek() ?? versions.state.peek().value?.items[0]?.version ?? recipe.version;
        const params = { path: { id: inspection.id }, header: { "Idempotency-Key": idempotencyKey() } };
        const calibration_id = calibration.peek() ?? null;
        const body = { recipe: versionName({ id: recipe.id, version }), calibration_id };
        const job = await data(api.POST("/api/v1/inspections/{id}/re-evaluate", { params, body }));
        // Without `wait_s` the response is a job.
        if (!("state" in job)) return goTo("inspections", job.id);
        jobs.update(job);
        steps.accepted();
        goTo("inspections", succeeded(await jobs.ended(job.id)));
      }),
    [api, jobs, inspection.id, versions.state],
  );
  return (
    <section class="card stack" aria-label={words.re_evaluate}>
      <h2>{words.re_evaluate}</h2>
      <p class="muted">{words.re_evaluate_hint}</p>
      <Show of={versions.state}>
        {({ items }) => (
          <div class="row end">
            <Choice
              label={words.version}
              value={chosen.value ?? items[0]?.version}
              options={items.map(({ version }) => {
                const name = versionName({ id: recipe.id, version });
                return [version, version === recipe.version ? words.version_used(name) : name];
              })}
              onChange={(version) => (chosen.value = version)}
            />
            <Choice
              label={words.calibration}
              value={calibration.value ?? inspection.calibration_id}
              options={[
                [inspection.calibration_id, words.version_used(inspection.calibration_id)],
                ...(calibrations.state.value.value ?? [])
                  .filter(({ id }) => id !== inspection.calibration_id)
                  .map(storedOption),
              ]}
              onChange={(id) => (calibration.value = id === inspection.calibration_id ? undefined : id)}
            />
            <CommandButton command={run} blocked={!inspection.scan_id && words.no_scan_left}>
              {words.re_evaluate}
            </CommandButton>
          </div>
        )}
      </Show>
    </section>
  );
}
