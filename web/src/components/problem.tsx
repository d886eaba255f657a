import type { Problem } from "../api/client";
import { language, text } from "../text";

const OF_SERVER = "urn:sheaf:problem:";
const OF_PAGE = "urn:sheaf:problem:page";

/** The language of what the server writes for people. */
const OF_THE_SERVER = "en";

/** What kind of problem it is, in the chosen language where its type is known. */
function titleOf({ type, title }: Problem): string {
  // English titles come with the problem, some more exact than their type.
  if (language.value === "en" || !type.startsWith(OF_SERVER)) return title;
  return text.value.problems[type.slice(OF_SERVER.length)] ?? title;
}

/** A problem: detail, cause and remedy. Server texts are English. */
export function ProblemCard({ problem, onDismiss }: { problem: Problem; onDismiss?: () => void }) {
  const words = text.value.common;
  // What the page itself says is in the chosen language.
  const own = problem.type === OF_PAGE ? undefined : OF_THE_SERVER;
  const unreachable = problem.type === `${OF_SERVER}unreachable`;
  return (
    <div class="problem" role="alert">
      <strong>{titleOf(problem)}</strong>
      <div lang={own}>
        {problem.detail}
        {problem.cause && ` (${problem.cause})`}
        {problem.pointer && <span class="mono"> {problem.pointer}</span>}
      </div>
      {problem.remedy && (
        <div>
          {words.remedy}:{" "}
          <span lang={unreachable ? undefined : own}>
            {unreachable ? words.unreachable_remedy : problem.remedy}
          </span>
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
