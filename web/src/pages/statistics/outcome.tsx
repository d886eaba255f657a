/** A statistic, or why it cannot be stated for this selection, which is no fault. */

import type { ReadonlySignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { ProblemCard } from "../../components/problem";
import type { Loaded } from "../../state/resource";
import { text } from "../../text";

export function Outcome<T>({
  of,
  children,
}: {
  of: ReadonlySignal<Loaded<T>>;
  children: (value: T) => ComponentChildren;
}): ComponentChildren {
  const { value, problem } = of.value;
  if (problem && problem.status !== 422 && problem.status !== 404) return <ProblemCard problem={problem} />;
  if (problem) {
    return (
      <p class="not-possible">
        {text.value.statistics.not_possible}{" "}
        <span lang="en">
          {problem.detail}
          {problem.remedy && `; ${problem.remedy}`}
        </span>
      </p>
    );
  }
  if (value === undefined) return <p class="muted">{text.value.frame.loading}</p>;
  return children(value);
}
