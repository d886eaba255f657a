import type { Problem } from "../api/client";
import { text } from "../text";

/** A refusal: what happened, why, and what to do. */
export function ProblemCard({ problem, onDismiss }: { problem: Problem; onDismiss?: () => void }) {
  const words = text.value.parts;
  return (
    <div class="problem" role="alert">
      <strong>{problem.title}</strong>
      <div>
        {problem.detail}
        {problem.cause && ` (${problem.cause})`}
        {problem.place && <span class="mono"> {problem.place}</span>}
      </div>
      {problem.remedy && (
        <div>
          {words.remedy}: {problem.remedy}
        </div>
      )}
      {onDismiss && (
        <button type="button" onClick={onDismiss}>
          {words.dismiss}
        </button>
      )}
    </div>
  );
}
