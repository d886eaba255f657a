/** The laser images of the poses; once computed, the models, angles and residuals. */

import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { Show, useLoaded } from "../../../components/loading/loading";
import { text } from "../../../text";
import { orderColour, orderName } from "../../../theme";
import { useCalibration } from "../details/details";
import { AnglesView, ModelsView } from "../details/models_view";
import { type Residuals, ResidualsView } from "../details/residuals_view";
import { ExposuresCard } from "../exposures/exposures_card";
import { type Dot, SessionImage } from "../session/session_image";
import type { Session } from "../session/session_state";
import { goToStep, type StepProperties } from "./wizard";

export function LightStep({ session, calibration_id, change }: StepProperties) {
  const words = text.value.calibration;
  return (
    <div class="stack">
      <p>{words.light_lead}</p>
      <ExposuresCard session={session} change={change} hint={words.exposures_next} />
      {calibration_id ? <Solved session={session} id={calibration_id} /> : <Lines session={session} />}
      <div>
        <button type="button" class="primary" onClick={() => goToStep(session.id, "stage")}>
          {words.next(words.step_names.stage ?? "")}
        </button>
      </div>
    </div>
  );
}

function Solved({ session, id }: { session: Session; id: string }) {
  const { api } = useApp();
  const calibration = useCalibration(id);
  const residuals = useLoaded(
    () => data(api.GET("/api/v1/calibrations/{id}/residuals", { params: { path: { id } } })),
    [api, id],
  );
  return (
    <>
      <Show of={calibration.state}>
        {(calibration) => (
          <div class="card stack">
            <ModelsView summary={calibration.summary} />
            <AnglesView document={calibration.calibration} />
            <ResidualsView id={id} document={calibration.calibration} />
          </div>
        )}
      </Show>
      <Lines session={session} residuals={residuals.state.value.value} />
    </>
  );
}

/** The laser images; with residuals, the points are drawn in the colours of their orders. */
function Lines({ session, residuals }: { session: Session; residuals?: Residuals | undefined }) {
  const words = text.value.calibration;
  const { poses } = session.body;
  if (poses.length === 0) return <p class="note">{words.light_none}</p>;
  // Poses of a calibration are numbered without those whose board was not detected.
  let n_readable = 0;
  const numbered = poses.map((pose, idx) => ({
    pose,
    number: idx + 1,
    pose_idx: pose.board.corners.length > 0 ? n_readable++ : -1,
  }));
  return (
    <section class="card stack">
      {residuals ? (
        <OrderLegend orders={residuals.orders.map(({ order }) => order)} />
      ) : (
        <p>{words.light_before}</p>
      )}
      <ul class="pose-list">
        {numbered.map(({ pose, number, pose_idx }) =>
          pose.laser ? (
            <li key={pose.id} class="pose">
              <SessionImage
                session={session}
                artifact={pose.laser.image.artifact}
                label={words.laser_image(number)}
                dots={residuals ? dotsOf(residuals, pose_idx) : found(pose.laser.lines_px)}
              />
              <div class="row">
                <strong class="grow">{words.pose(number)}</strong>
                <small class="muted number">
                  {words.lines_found(String(pose.laser.n_segments))}
                  {pose.laser.background && ` · ${words.ambient_subtracted}`}
                </small>
              </div>
              {pose.laser.problem && <small class="bad">⚠ {pose.laser.problem}</small>}
            </li>
          ) : null,
        )}
      </ul>
    </section>
  );
}

function found(lines: readonly (readonly (readonly number[])[])[]): Dot[] {
  return lines.flatMap((line) => line.map(([u = 0, v = 0]) => [u, v, undefined] as const));
}

function dotsOf(residuals: Residuals, pose_idx: number): Dot[] {
  return residuals.orders.flatMap(({ order, points }) =>
    points.filter(([pose]) => pose === pose_idx).map(([, u = 0, v = 0]) => [u, v, order] as const),
  );
}

function OrderLegend({ orders }: { orders: readonly number[] }) {
  const words = text.value.calibration;
  return (
    <ul class="plain row legend data-view order-legend">
      {orders.map((order) => (
        <li key={order} class="row">
          <span class="swatch" style={{ background: orderColour(order) }} />
          {words.order_named(orderName(order))}
        </li>
      ))}
    </ul>
  );
}
