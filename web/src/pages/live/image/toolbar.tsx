/** The toolbar of the image: visible orders, zebra, freeze; and the zoom buttons. */

import { language, text } from "../../../text";
import { NO_ORDER, orderColour, orderName } from "../../../theme";
import { decimal } from "../../../units";
import type { LiveView } from "../live_view";

export function Toolbar({ view }: { view: LiveView }) {
  const words = text.value.live;
  return (
    <div class="row live-toolbar">
      <fieldset class="row orders">
        <legend class="visually-hidden">{words.orders}</legend>
        {view.orders.value.map((order, idx) => (
          <OrderButton key={order} view={view} order={order} nth={idx + 1} />
        ))}
      </fieldset>
      <span class="grow" />
      <button
        type="button"
        aria-pressed={view.zebra.value}
        title={words.zebra_hint}
        onClick={() => view.showZebra(!view.zebra.peek())}
      >
        {words.zebra}
      </button>
      <button
        type="button"
        aria-pressed={view.frozen.value}
        title={words.freeze_hint}
        onClick={() => view.freeze(!view.frozen.peek())}
      >
        {view.frozen.value ? words.resume : words.freeze}
      </button>
    </div>
  );
}

export function ZoomButtons({ view }: { view: LiveView }) {
  const words = text.value.live;
  const { px, is_fitted } = view.scale.value;
  const at_one = !is_fitted && Math.abs(px - 1) < 1e-6;
  return (
    <fieldset class="zoom">
      <legend class="visually-hidden">{words.zoom}</legend>
      <button
        type="button"
        aria-label={words.zoom_out}
        title={`${words.zoom_out} (−)`}
        onClick={() => view.camera_image.zoomBy(1 / 1.5)}
      >
        −
      </button>
      <span class="number zoom-value">{decimal(100 * px, 0, language.value)} %</span>
      <button
        type="button"
        aria-label={words.zoom_in}
        title={`${words.zoom_in} (+)`}
        onClick={() => view.camera_image.zoomBy(1.5)}
      >
        +
      </button>
      <button
        type="button"
        aria-pressed={is_fitted}
        title={words.fit_hint}
        onClick={() => view.camera_image.fit()}
      >
        {words.fit}
      </button>
      <button
        type="button"
        aria-pressed={at_one}
        title={words.one_to_one_hint}
        onClick={() => view.camera_image.zoomTo(1)}
      >
        1 : 1
      </button>
    </fieldset>
  );
}

function OrderButton({ view, order, nth }: { view: LiveView; order: number; nth: number }) {
  const words = text.value.live;
  const shown = !view.hidden.value.has(order);
  const name = order === NO_ORDER ? words.without_order : orderName(order);
  return (
    <button
      type="button"
      class="order"
      aria-pressed={shown}
      aria-label={words.order_hint(name, nth)}
      title={words.order_hint(name, nth)}
      data-order={order}
      onClick={() => view.toggleOrder(order)}
    >
      <Swatch order={order} hollow={!shown} />
      {name}
    </button>
  );
}

/** The colour of an order on the dark background of data views. */
export function Swatch({ order, hollow = false }: { order: number; hollow?: boolean }) {
  return (
    <svg class="swatch" viewBox="0 0 22 14" aria-hidden="true">
      <rect width="22" height="14" rx="3" fill="#14171a" />
      <path
        d="M3 7h16"
        stroke={orderColour(order)}
        stroke-width="3"
        stroke-dasharray={hollow ? "1 4" : undefined}
      />
    </svg>
  );
}
