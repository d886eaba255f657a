/** Below the image: values at the pointer. */

import { language, text } from "../../../text";
import { NO_ORDER, orderName } from "../../../theme";
import { count, decimal, length } from "../../../units";
import type { LiveView } from "../live_view";

export function ReadoutLine({ view }: { view: LiveView }) {
  const words = text.value.live;
  const readout = view.readout.value;
  const chosen = language.value;
  if (!readout) return <p class="readout muted">{words.readout_hint}</p>;
  const { u_px, v_px, grey, order, point } = readout;
  const on_line = order !== undefined;
  const digits = on_line ? 2 : 0;
  return (
    <p class="readout number" data-order={order}>
      <Fact name="u">{decimal(u_px, digits, chosen)} px</Fact>
      <Fact name="v">{decimal(v_px, digits, chosen)} px</Fact>
      <Fact name={words.grey}>{count(grey, chosen)} / 255</Fact>
      {on_line && <Fact name={words.order}>{order === NO_ORDER ? words.none : orderName(order)}</Fact>}
      {point && (
        <>
          <Fact name="x">{decimal(point.x_mm, 3, chosen)} mm</Fact>
          <Fact name="y">{decimal(point.y_mm, 3, chosen)} mm</Fact>
          <Fact name="z">{decimal(point.z_mm, 3, chosen)} mm</Fact>
          <Fact name="σ">{length(point.sigma_mm, chosen)}</Fact>
        </>
      )}
    </p>
  );
}

function Fact({ name, children }: { name: string; children: preact.ComponentChildren }) {
  return (
    <span class="readout-fact">
      <small>{name}</small> {children}
    </span>
  );
}
