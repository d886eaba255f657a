import type { Problem } from "../api/client";
import { language, text } from "../text";

const PROBLEM_PREFIX = "urn:sheaf:problem:";
const PAGE_PROBLEM = "urn:sheaf:problem:page";

/** The language of the server's messages. */
const SERVER_LANGUAGE = "en";

/** Title of the problem, translated if its type is known. */
function titleOf({ type, title }: Problem): string {
  // English titles come with the problem; some are more specific than the type.
  if (language.value === "en" || !type.startsWith(PROBLEM_PREFIX)) return title;
  return text.value.problems[type.slice(PROBLEM_PREFIX.length)] ?? title;
}

/** A problem: detail, cause and remedy. Server texts are English. */
export function ProblemCard({ problem, onDismiss }: { problem: Problem; onDismiss?: () => void }) {
  const words = text.value.common;
  // Problems created by the page are in the chosen language.
  const lang = problem.type === PAGE_PROBLEM ? undefined : SERVER_LANGUAGE;
  const unreachable = problem.type === `${PROBLEM_PREFIX}unreachable`;
  return (
    <div class="problem" role="alert">
      <strong>{titleOf(problem)}</strong>
      <div lang={lang}>
        {problem.detail}
        {problem.cause && ` (${problem.cause})`}
        {problem.pointer && <span class="mono"> {problem.pointer}</span>}
      </div>
      {problem.remedy && (
        <div>
          {words.remedy}:{" "}
          <span lang={unreachable ? undefined : lang}>
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
