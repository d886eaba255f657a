import type { Problem } from "../api/client";
import { language, text } from "../text";

const OF_SERVER = "urn:sheaf:problem:";
const OF_PAGE = "urn:sheaf:problem:page";

/** The language of the server's messages. */
const OF_THE_SERVER = "en";

/** Title of the problem, translated if its type is known. */
function titleOf({ type, title }: Problem): string {
  // English titles come with the problem; some are more specific than the type.
  if (language.value === "en" || !type.startsWith(OF_SERVER)) return title;
  return text.value.problems[type.slice(OF_SERVER.length)] ?? title;
}

/** A problem: detail, cause and remedy. Server texts are English. */
export function ProblemCard({ problem, onDismiss }: { problem: Problem; onDismiss?: () => void }) {
  const words = text.value.common;
  // Problems created by the page are in the chosen language.
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
