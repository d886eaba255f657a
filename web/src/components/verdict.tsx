/** A verdict as text with a symbol, never as colour alone: OK is grey, NOT OK red. */

import { OUTCOME_SYMBOL } from "../state/records/outcome";
import type { Verdict } from "../state/records/scanned";
import { text } from "../text";

export function VerdictWord({ verdict, big }: { verdict: Verdict | undefined; big?: boolean }) {
  if (!verdict) return <span class="muted">–</span>;
  return (
    <span class={`verdict ${verdict}${big ? " big" : ""}`} data-verdict={verdict}>
      <span aria-hidden="true">{OUTCOME_SYMBOL[verdict]}</span> {text.value.outcomes[verdict]}
    </span>
  );
}
