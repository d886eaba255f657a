/** The last parts with serial number, verdict and time, the newest first. */

import { href } from "../../../state/browser/route";
import type { Inspection } from "../../../state/records/inspections";
import { OUTCOME_SYMBOL } from "../../../state/records/outcome";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";

/** Number of parts shown. */
export const N_LAST_INSPECTIONS = 20;

export function LastInspections({ items }: { items: readonly Inspection[] }) {
  const words = text.value.operate;
  const n_rejected = items.filter(({ verdict }) => verdict === "not_ok" || verdict === "invalid").length;
  return (
    <section class="card" aria-label={words.last_parts}>
      <div class="row">
        <h2 class="grow">{words.last_parts}</h2>
        <span class="muted">{items.length > 0 && words.rejected_of(n_rejected, items.length)}</span>
      </div>
      {items.length === 0 && <p class="muted">{words.no_inspected_parts}</p>}
      <ol class="last-inspections">
        {items.map((item) => (
          <li key={item.id}>
            <a class={item.verdict} href={href("inspections", item.id)} data-part={item.serial}>
              <span class="symbol" aria-hidden="true">
                {OUTCOME_SYMBOL[item.verdict]}
              </span>
              <span class="part">
                <strong>{item.serial}</strong>
                <span>{text.value.outcomes[item.verdict]}</span>
                <small>{dateTime(item.created_at_ms, language.value)}</small>
              </span>
            </a>
          </li>
        ))}
      </ol>
    </section>
  );
}
