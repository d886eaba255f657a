/** A verdict as words, never as a colour alone: OK is grey, what is not is red with a sign. */

import { text } from "../../text";
import type { Verdict } from "./scan_record";

const SIGNS: Record<Verdict, string> = { pass: "✓", fail: "✕", undecided: "?" };

export function VerdictWord({ verdict, big }: { verdict: Verdict | undefined; big?: boolean }) {
  const words = text.value.result;
  if (!verdict) return <span class="muted">–</span>;
  return (
    <span class={`verdict ${verdict}${big ? " big" : ""}`} data-verdict={verdict}>
      <span aria-hidden="true">{SIGNS[verdict]}</span> {words.verdicts[verdict]}
    </span>
  );
}
