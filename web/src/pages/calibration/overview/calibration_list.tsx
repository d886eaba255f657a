/** All calibrations, newest first, with their actions. */

import { href } from "../../../state/browser/route";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { px, um } from "../details/format";
import type { CalibrationItem } from "../details/summary";
import { ActivateButton } from "./activate";

interface Properties {
  items: readonly CalibrationItem[];
  active_id: string | undefined;
  onCompare: (id: string) => void;
  reload: () => Promise<void>;
}

export function CalibrationList({ items, active_id, onCompare, reload }: Properties) {
  const words = text.value.calibration;
  if (items.length === 0) {
    return (
      <section class="card">
        <h2>{words.list}</h2>
        <p class="muted">{words.list_empty}</p>
      </section>
    );
  }
  return (
    <section class="card">
      <h2>{words.list}</h2>
      <div class="scroll-x">
        <table class="calibrations">
          <thead>
            <tr>
              <th scope="col">{words.created}</th>
              <th scope="col">{words.id}</th>
              <th scope="col">{words.state}</th>
              <th scope="col">{words.model}</th>
              <th scope="col" class="number">
                {words.camera_rms}
              </th>
              <th scope="col" class="number">
                {words.depth}
              </th>
              <th scope="col">
                <span class="visually-hidden">{text.value.common.more}</span>
              </th>
            </tr>
          </thead>
          <tbody>
            {items.map((item) => (
              <tr key={item.id} data-calibration={item.id} data-is-active={item.active}>
                <td>{dateTime(item.created_at_ms, language.value)}</td>
                <td class="mono">{item.id}</td>
                <td>
                  <span class="tag">{item.active ? words.active_state : words.draft}</span>
                </td>
                <td>{words.model_names[item.summary.model ?? ""] ?? "–"}</td>
                <td class="number">{px(item.summary.corner_rms_px)}</td>
                <td class="number">{um(item.summary.systematic_sigma_mm)}</td>
                <td>
                  <div class="row acts">
                    <a class="button" href={href("calibration", undefined, { show: item.id })}>
                      {words.details}
                    </a>
                    {item.report && (
                      <a class="button" href={item.report} target="_blank" rel="noopener">
                        {words.report_short}
                      </a>
                    )}
                    {active_id && !item.active && (
                      <button type="button" title={words.compare_hint} onClick={() => onCompare(item.id)}>
                        {words.compare}
                      </button>
                    )}
                    {!item.active && <ActivateButton item={item} reload={reload} />}
                  </div>
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}
