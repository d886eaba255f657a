import type { Problem } from "../api/client";
import { language, text } from "../text";

const OF_SERVER = "urn:sheaf:problem:";

/** What kind of problem it is, in the chosen language where its type is known. */
function titleOf({ type, title }: Problem): string {
  // English titles come with the problem, some more exact than their type.
  if (language.value === "en" || !type.startsWith(OF_SERVER)) return title;
  return text.value.problems[type.slice(OF_SERVER.length)] ?? title;
}

/** A refusal: what happened, why, and what to do. The server speaks English. */
export function ProblemCard({ problem, onDismiss }: { problem: Problem; onDismiss?: () => void }) {
  const words = text.value.parts;
  return (
    <div class="problem" role="alert">
      <strong>{titleOf(problem)}</strong>
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
