/** Residuals of a calibration over the image: laser points of each order, corners of the boards. */

import { data, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { Show, useLoaded } from "../../../components/loading/loading";
import { language, text } from "../../../text";
import { orderName } from "../../../theme";
import { count, decimal } from "../../../units";
import { px } from "./format";
import { drawArrows, drawDots, niceCeiling } from "./heat_map";
import { MapView, ScaleLegend } from "./map_view";
import { type CalibrationDocument, residualsByOrder } from "./summary";

export type Residuals = Schemas["ResidualsDto"];

/** The colour scale ends at this multiple of the RMS, which includes all but rare outliers. */
const SCALE_OF_RMS = 3;

/** Length of a typical arrow as a share of the image's width. */
const ARROW_FRACTION = 0.02;

export function ResidualsView({ id, document }: { id: string; document: CalibrationDocument }) {
  const { api } = useApp();
  const { state } = useLoaded(
    () => data(api.GET("/api/v1/calibrations/{id}/residuals", { params: { path: { id } } })),
    [api, id],
  );
  return (
    <section class="stack residuals">
      <h3>{text.value.calibration.residuals}</h3>
      <Show of={state}>
        {(residuals) => (
          <>
            {residuals.orders.length > 0 && <LightMaps residuals={residuals} document={document} />}
            <CornerMap residuals={residuals} />
          </>
        )}
      </Show>
    </section>
  );
}

function LightMaps({ residuals, document }: { residuals: Residuals; document: CalibrationDocument }) {
  const words = text.value.calibration;
  const sums = residualsByOrder(document);
  const worst = Math.max(...sums.map((sum) => sum.rms_px));
  const end_px = niceCeiling(SCALE_OF_RMS * worst);
  const sumOf = (order: number) => sums.find((sum) => sum.order === order);
  return (
    <>
      <h4>{words.residuals_light}</h4>
      <div class="maps">
        {residuals.orders.map(({ order, points }) => (
          <MapView
            key={order}
            caption={words.order_named(orderName(order))}
            label={words.residuals_label(orderName(order), px(sumOf(order)?.rms_px))}
            aspect={residuals.height_px / residuals.width_px}
            draw={(canvas) =>
              drawDots(
                canvas,
                residuals,
                points.map(([, u = 0, v = 0, value = 0]) => [u, v, value] as const),
                end_px,
              )
            }
            inputs={[residuals]}
          />
        ))}
      </div>
      <ScaleLegend
        end={end_px}
        format={(value) => px(value, 2)}
        low={words.residual_negative}
        high={words.residual_positive}
      />
      <p class="muted">{words.residuals_light_hint}</p>
      <div class="scroll-x">
        <table class="order-sums">
          <thead>
            <tr>
              <th scope="col">{words.order}</th>
              <th scope="col" class="number">
                {words.points}
              </th>
              <th scope="col" class="number">
                {words.mean}
              </th>
              <th scope="col" class="number">
                {words.rms}
              </th>
              <th scope="col" class="number">
                {words.outliers}
              </th>
            </tr>
          </thead>
          <tbody>
            {sums.map((sum) => (
              <tr key={sum.order}>
                <th scope="row">{orderName(sum.order)}</th>
                <td class="number">{count(sum.n_points, language.value)}</td>
                <td class="number">{px(sum.mean_px, 4)}</td>
                <td class="number">{px(sum.rms_px, 4)}</td>
                <td class="number">{count(sum.n_outliers, language.value)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}

function CornerMap({ residuals }: { residuals: Residuals }) {
  const words = text.value.calibration;
  const { corners, width_px } = residuals;
  const squares = corners.reduce((sum, [, , du = 0, dv = 0]) => sum + du ** 2 + dv ** 2, 0);
  const rms_px = Math.sqrt(squares / Math.max(1, corners.length));
  const factor = Math.max(1, niceCeiling((ARROW_FRACTION * width_px) / Math.max(rms_px, 1e-6)) / 2);
  return (
    <>
      <h4>{words.residuals_corners}</h4>
      <div class="maps">
        <MapView
          label={words.corners_label(px(rms_px, 4))}
          aspect={residuals.height_px / width_px}
          draw={(canvas) => drawArrows(canvas, residuals, corners, factor)}
          inputs={[residuals]}
        />
        <dl class="facts">
          <dt>{words.corners}</dt>
          <dd>{count(corners.length, language.value)}</dd>
          <dt>{words.rms}</dt>
          <dd>{px(rms_px, 4)}</dd>
        </dl>
      </div>
      <p class="muted">{words.residuals_corners_hint(decimal(factor, 0, language.value))}</p>
    </>
  );
}
