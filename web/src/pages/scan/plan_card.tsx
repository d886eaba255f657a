/** The scan plan computed by the server before the stage moves. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { data, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { useLoaded } from "../../components/loading/loading";
import { ProblemCard } from "../../components/problem";
import { href } from "../../state/browser/route";
import type { Loaded } from "../../state/resource";
import { language, text } from "../../text";
import { bytes, count, decimal, duration, length } from "../../units";
import type { SetUp } from "./set_up";

type Plan = Schemas["ScanPlanDto"];

/** Delay after the last change until the plan is requested, ms. */
const PAUSE_MS = 250;

/** The server's plan for the settings, requested shortly after each change; empty while outdated. */
export function usePlan(set_up: SetUp): Loaded<Plan> {
  const { api, station } = useApp();
  const asked = useSignal(set_up.request.value);
  const wanted = set_up.request.value;
  const key = JSON.stringify(wanted);
  useEffect(() => {
    const timer = setTimeout(() => {
      asked.value = wanted;
    }, PAUSE_MS);
    return () => clearTimeout(timer);
  }, [key]);
  // Request again when the state of the station changes, because the plan may have become possible.
  const state = station.status.value?.state;
  const { state: loaded } = useLoaded(
    async () => await data(api.POST("/api/v1/scans/plan", { body: asked.peek() })),
    [JSON.stringify(asked.value)],
    [state, station.stale.value],
  );
  return JSON.stringify(asked.value) === key ? loaded.value : {};
}

export function PlanCard({ plan, wrong }: { plan: Loaded<Plan>; wrong: string | undefined }) {
  const words = text.value.scan;
  return (
    <section
      class="card"
      aria-label={words.plan}
      data-plan={wrong || plan.problem ? "refused" : plan.value ? "there" : "asked"}
    >
      <h2>{words.plan}</h2>
      {wrong && <p class="muted">{wrong}</p>}
      {!wrong && <PlanResult plan={plan} />}
    </section>
  );
}

function PlanResult({ plan }: { plan: Loaded<Plan> }) {
  const { station } = useApp();
  const words = text.value.scan;
  const uncalibrated = station.status.value?.activity === "not calibrated";
  return (
    <>
      {plan.problem && !station.stale.value && <ProblemCard problem={plan.problem} />}
      {plan.problem && uncalibrated && (
        <p class="after">
          <a class="button" href={href("calibration")}>
            {words.go_calibrate}
          </a>
        </p>
      )}
      {plan.value && !plan.problem && <PlanFacts plan={plan.value} />}
      {!plan.value && !plan.problem && <p class="muted">{text.value.frame.loading}</p>}
    </>
  );
}

function PlanFacts({ plan }: { plan: Plan }) {
  const words = text.value.scan;
  const shown = language.value;
  const span = ([near, far]: number[]) => `${decimal(near, 1, shown)} – ${decimal(far, 1, shown)} mm`;
  return (
    <>
      <dl class="facts">
        <dt>{words.duration}</dt>
        <dd>
          <strong>{duration(plan.duration_s, shown)}</strong>
        </dd>
        <dt>{words.rows}</dt>
        <dd>
          {count(plan.n_rows, shown)},{" "}
          {words.every(
            plan.step_deg != null ? `${decimal(plan.step_deg, 2, shown)}°` : length(plan.step_mm, shown),
          )}
          {plan.speed_mm_s != null && `, ${decimal(plan.speed_mm_s, 2, shown)} mm/s`}
          {plan.speed_deg_s != null && `, ${decimal(plan.speed_deg_s, 2, shown)} °/s`}
        </dd>
        <dt>{words.density}</dt>
        <dd>{words.per_mm2(decimal(plan.points_per_mm2, 1, shown))}</dd>
        <dt>{words.points}</dt>
        <dd>{words.at_most(count(plan.max_points, shown), plan.n_orders)}</dd>
        <dt>{words.sigma}</dt>
        <dd>{length(plan.predicted_sigma_mm, shown)}</dd>
        <dt>{words.depth}</dt>
        <dd>{span(plan.depth_mm)}</dd>
        <dt>{words.unambiguous}</dt>
        <dd>{span(plan.unambiguous_depth_mm)}</dd>
        <dt>{words.exposure}</dt>
        <dd>
          {(plan.exposures_us.length > 0 ? plan.exposures_us : [plan.exposure_us])
            .map((exposure_us) => decimal(exposure_us / 1000, 2, shown))
            .join(" + ")}{" "}
          ms, {decimal(100 * plan.laser_power, 0, shown)} % {words.laser}
        </dd>
        <dt>{words.disk}</dt>
        <dd>{bytes(plan.disk_bytes, shown)}</dd>
      </dl>
      {plan.notes.map((note) => (
        <p class="plan-note" key={note} lang="en">
          {note}
        </p>
      ))}
    </>
  );
}
