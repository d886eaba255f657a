/** The picked points with exact values from the server, and the distance between two. */

import { subtract } from "../../scene/cloud/shapes";
import { sigmaOfClass } from "../../stream/protocol";
import { language, text } from "../../text";
import { orderName } from "../../theme";
import { count, decimal, length } from "../../units";
import { type PickedPoint, positionOf, type ViewState } from "./view_state";

export function Picks({ state }: { state: ViewState }) {
  const words = text.value.viewer;
  const picks = state.picks.value;
  if (picks.length === 0) return null;
  return (
    <div class="card picks">
      <div class="row">
        <h2 class="grow">{words.picked}</h2>
        <button type="button" onClick={() => state.clearPicks()}>
          {words.clear}
        </button>
      </div>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reached by keys */}
      <section class="scroll" tabIndex={0} aria-label={words.picked}>
        <table>
          <thead>
            <tr>
              <th>
                <span class="visually-hidden">{words.picked}</span>
              </th>
              {["x", "y", "z"].map((axis) => (
                <th class="number" key={axis}>
                  {axis}, mm
                </th>
              ))}
              <th class="number">σ</th>
              <th class="number">{words.order}</th>
              <th class="number">{words.pixel}</th>
              <th class="number">{words.frame}</th>
              <th>{words.source}</th>
            </tr>
          </thead>
          <tbody>
            {picks.map((point, idx) => (
              <PickRow key={`${idx}-${point.displayed.position_mm}`} point={point} number={idx + 1} />
            ))}
          </tbody>
        </table>
      </section>
      <Between picks={picks} />
    </div>
  );
}

function PickRow({ point, number }: { point: PickedPoint; number: number }) {
  const words = text.value.viewer;
  const { exact, displayed, state } = point;
  const digits = exact ? 4 : 2;
  const sigma_mm = exact?.sigma_mm ?? sigmaOfClass(displayed.sigma_class);
  return (
    <tr data-pick={state}>
      <th scope="row">{number}</th>
      {positionOf(point).map((value, axis) => (
        <td class="number" key={["x", "y", "z"][axis]}>
          {decimal(value, digits, language.value)}
        </td>
      ))}
      <td class="number">{length(sigma_mm, language.value)}</td>
      <td class="number">{orderName(displayed.order)}</td>
      <td class="number">
        {exact
          ? `${decimal(exact.u_px, 2, language.value)} / ${decimal(exact.v_px, 2, language.value)} px`
          : `${displayed.along_px} px`}
      </td>
      <td class="number">{count(displayed.frame, language.value)}</td>
      <td>{words.sources[state]}</td>
    </tr>
  );
}

function Between({ picks }: { picks: readonly PickedPoint[] }) {
  const words = text.value.viewer;
  const [first, second] = picks;
  if (!first || !second) return <p class="muted">{words.pick_another}</p>;
  const [dx, dy, dz] = subtract(positionOf(second), positionOf(first));
  const mm = (value: number) => `${decimal(value, 3, language.value)} mm`;
  return (
    <dl class="facts">
      <dt>{words.distance}</dt>
      <dd>
        <strong>{mm(Math.hypot(dx, dy, dz))}</strong> (Δx {mm(dx)}, Δy {mm(dy)}, Δz {mm(dz)})
      </dd>
    </dl>
  );
}
