/** The last parts as ticks, the newest at the right. */

import { href } from "../../state/browser/route";
import { decidingCharacteristic, OUTCOME_SYMBOL, type Outcome, outcomeOf } from "../../state/records/outcome";
import type { ScannedPart } from "../../state/records/scanned";
import { language, text } from "../../text";
import { dateTime, decimal } from "../../units";

/** Number of parts shown. */
export const N_LAST_PARTS = 20;

export function LastParts({ parts }: { parts: readonly ScannedPart[] }) {
  const words = text.value.operate;
  const shown = parts.slice(0, N_LAST_PARTS).reverse();
  const failed = shown.filter((part) => rejected(outcomeOf(part))).length;
  return (
    <section class="card" aria-label={words.last_parts}>
      <div class="row">
        <h2 class="grow">{words.last_parts}</h2>
        <span class="muted">{shown.length > 0 && words.rejected_of(failed, shown.length)}</span>
      </div>
      {shown.length === 0 && <p class="muted">{words.no_parts}</p>}
      <ol class="ticks">
        {shown.map((part) => (
          <li key={part.scan.id}>
            <a
              class={`tick ${outcomeOf(part)}`}
              href={href("result", part.scan.id)}
              title={summaryOf(part)}
              aria-label={summaryOf(part)}
            >
              {OUTCOME_SYMBOL[outcomeOf(part)]}
            </a>
          </li>
        ))}
      </ol>
    </section>
  );
}

/** Whether the part is a reject. */
function rejected(outcome: Outcome): boolean {
  return outcome === "not_ok" || outcome === "invalid";
}

function summaryOf(part: ScannedPart): string {
  const measured = decidingCharacteristic(part);
  const value = measured?.value !== undefined && `${decimal(measured.value, 3, language.value)} ${measured.unit}`;
  const words = [part.scan.name, text.value.outcomes[outcomeOf(part)], value];
  return [...words, dateTime(part.scan.created_at_ms, language.value)].filter(Boolean).join(", ");
}
