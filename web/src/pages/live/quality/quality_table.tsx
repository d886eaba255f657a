/** Table of the quality of the lines in the displayed frame, for each order. */

import { language, text } from "../../../text";
import { NO_ORDER, orderName } from "../../../theme";
import { count, decimal, length } from "../../../units";
import { Swatch } from "../image/toolbar";
import type { LiveView } from "../live_view";
import { SEGMENT_POINTS } from "./quality";

/** Share of saturated points above which it is highlighted, because the line centre is biased. */
const TOO_MANY_SATURATED = 0.05;

export function QualityTable({ view }: { view: LiveView }) {
  const words = text.value.live;
  const chosen = language.value;
  const rows = view.quality.value;
  const percent = (share: number | undefined, digits: number) =>
    share === undefined ? "–" : `${decimal(100 * share, digits, chosen)} %`;
  return (
    <section class="card quality">
      <h2>{words.quality}</h2>
      {rows.length === 0 ? (
        <p class="muted">{view.values.value?.laser_on === false ? words.laser_off : words.no_lines}</p>
      ) : (
        // biome-ignore lint/a11y/noNoninteractiveTabindex: a table wider than a phone scrolls by keys
        <section class="table-scroll" tabIndex={0} aria-label={words.quality}>
          <table>
            <thead>
              <tr>
                <th scope="col">{words.order}</th>
                <th scope="col" class="number">
                  {words.points}
                </th>
                <th scope="col" class="number" title={words.coverage_hint}>
                  {words.coverage}
                </th>
                <th scope="col" class="number" title={words.brightness_hint}>
                  {words.brightness}
                </th>
                <th scope="col" class="number" title={words.saturated_hint}>
                  {words.saturated}
                </th>
                <th scope="col" class="number" title={words.sigma_hint}>
                  {words.sigma}
                </th>
                <th scope="col" class="number" title={words.scatter_hint(SEGMENT_POINTS)}>
                  {words.scatter}
                </th>
              </tr>
            </thead>
            <tbody>
              {rows.map((row) => {
                const bad = (row.saturated ?? 0) > TOO_MANY_SATURATED;
                return (
                  <tr key={row.order} data-order={row.order}>
                    <th scope="row">
                      <span class="row order-name">
                        <Swatch order={row.order} />
                        {row.order === NO_ORDER ? words.without_order : orderName(row.order)}
                      </span>
                    </th>
                    <td class="number">{count(row.n_points, chosen)}</td>
                    <td class="number">{percent(row.coverage, 0)}</td>
                    <td class="number">{count(row.grey, chosen)}</td>
                    <td class="number">
                      {bad ? (
                        <span class="tag bad">⚠ {percent(row.saturated, 1)}</span>
                      ) : (
                        percent(row.saturated, 1)
                      )}
                    </td>
                    <td class="number">{length(row.sigma_mm, chosen)}</td>
                    <td class="number">{length(row.scatter_mm, chosen)}</td>
                  </tr>
                );
              })}
            </tbody>
          </table>
        </section>
      )}
      <p class="muted small">{words.quality_note(SEGMENT_POINTS)}</p>
    </section>
  );
}
