/** Depth difference between two calibrations over the working volume, for each order. */

import { data, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { Show, useLoaded } from "../../../components/loading/loading";
import { language, text } from "../../../text";
import { orderName } from "../../../theme";
import { count } from "../../../units";
import { um } from "./format";
import { drawGrid, niceCeiling } from "./heat_map";
import { MapView, ScaleLegend } from "./map_view";

type Difference = Schemas["CalibrationDifferenceDto"];

export function Comparison({ one, other, onClose }: { one: string; other: string; onClose?: () => void }) {
  const { api } = useApp();
  const words = text.value.calibration;
  const { state } = useLoaded(
    () =>
      data(api.GET("/api/v1/calibrations/{id}/diff", { params: { path: { id: one }, query: { with: other } } })),
    [api, one, other],
  );
  return (
    <section class="card stack comparison" aria-label={words.difference}>
      <div class="row">
        <h2 class="grow">{words.difference}</h2>
        {onClose && (
          <button type="button" onClick={onClose}>
            {words.close_comparison}
          </button>
        )}
      </div>
      <p>{words.difference_lead(one, other)}</p>
      <Show of={state}>{(difference) => <Maps difference={difference} />}</Show>
    </section>
  );
}

function Maps({ difference }: { difference: Difference }) {
  const words = text.value.calibration;
  // Differences below 0.1 µm are rounding errors.
  const end_mm = niceCeiling(Math.max(1e-4, Math.abs(difference.total.max_mm)));
  const { columns, rows } = difference;
  return (
    <>
      <table class="difference">
        <thead>
          <tr>
            <th scope="col">{words.order}</th>
            <th scope="col" class="number">
              {words.mean}
            </th>
            <th scope="col" class="number">
              {words.rms}
            </th>
            <th scope="col" class="number">
              {words.largest}
            </th>
            <th scope="col" class="number">
              {words.pixels}
            </th>
          </tr>
        </thead>
        <tbody>
          <Row name={words.all_orders} total={difference.total} />
          {difference.orders.map((order) => (
            <Row key={order.order} name={orderName(order.order)} total={order.total} />
          ))}
        </tbody>
      </table>
      <div class="maps">
        {difference.orders.map((order) => (
          <MapView
            key={order.order}
            caption={words.order_named(orderName(order.order))}
            label={words.map_label(orderName(order.order), um(order.total.rms_mm), um(order.total.max_mm))}
            aspect={rows / columns}
            draw={(canvas) => drawGrid(canvas, { columns, rows, values: order.depth_mm }, end_mm)}
            inputs={[difference]}
          />
        ))}
      </div>
      <ScaleLegend end={end_mm} format={(value) => um(value)} low={words.nearer} high={words.deeper} />
      <p class="muted">{words.empty_cells}</p>
    </>
  );
}

function Row({ name, total }: { name: string; total: Schemas["DepthDifferenceDto"] }) {
  return (
    <tr>
      <th scope="row">{name}</th>
      <td class="number">{um(total.mean_mm)}</td>
      <td class="number" data-rms-mm={total.rms_mm}>
        {um(total.rms_mm)}
      </td>
      <td class="number">{um(total.max_mm)}</td>
      <td class="number">{count(total.n_pixels, language.value)}</td>
    </tr>
  );
}
