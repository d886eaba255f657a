/** The stages of an inspection, with the current one marked. */

import type { Job } from "../../../api/client";
import { text } from "../../../text";
import { STAGES, stageOf } from "./last";

export function Stages({ job }: { job: Job }) {
  const current = stageOf(job);
  return (
    <ol class="stages">
      {STAGES.map((stage, idx) => (
        <li
          key={stage}
          aria-current={stage === current ? "step" : undefined}
          data-passed={idx < STAGES.indexOf(current)}
        >
          {text.value.operate.stages[stage]}
        </li>
      ))}
    </ol>
  );
}
