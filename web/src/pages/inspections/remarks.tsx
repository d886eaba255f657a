/** What the server remarks on a result: reasons, findings, missing parts of U, notes. */

import type { CharacteristicResult } from "../../state/records/inspections";
import { text } from "../../text";

export function Remarks({ result }: { result: CharacteristicResult }) {
  // `reason` contains `failure`.
  const reasons = [result.reason ?? result.failure, ...result.findings.map((finding) => finding.text)];
  return (
    <>
      {[...new Set(reasons)].map(
        (reason) =>
          reason && (
            <div key={reason} class="reason" lang="en">
              {reason}
            </div>
          ),
      )}
      {result.uncertainty_missing.length > 0 && (
        <div class="reason">
          {text.value.inspections.incomplete} <span lang="en">{result.uncertainty_missing.join(", ")}</span>
        </div>
      )}
      {result.notes.map((note) => (
        <div key={note} class="muted" lang="en">
          {note}
        </div>
      ))}
    </>
  );
}
