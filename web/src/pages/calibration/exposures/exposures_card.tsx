/** The exposures of a session in progress, folded: their values in a line, and the fields to change them. */

import { useMemo } from "preact/hooks";
import { useApp } from "../../../app";
import { useForm } from "../../../components/fields/form";
import { written } from "../../../components/fields/typed_number";
import { ProblemCard } from "../../../components/problem";
import { language, text } from "../../../text";
import type { Change } from "../session/session_change";
import type { Session } from "../session/session_state";
import { ExposureChanges } from "./exposure_changes";
import { ExposureFields } from "./exposure_fields";

interface Properties {
  session: Session;
  change: Change;
  /** When a change takes effect. */
  hint: string;
}

export function ExposuresCard({ session, change, hint }: Properties) {
  const { api } = useApp();
  const words = text.value.calibration;
  const form = useForm();
  const changes = useMemo(() => new ExposureChanges(api, change), [api, change]);
  const exposures = changes.shown(session);
  const problem = changes.save.problem.value;
  const number = (value: number) => written(value, language.value);
  const summary = words.exposures_summary(
    number(exposures.board_exposure_us),
    number(exposures.laser_exposure_us),
    number(100 * exposures.laser_power),
  );
  return (
    <details class="card exposures">
      <summary>
        <strong>{words.exposures}</strong> <span class="muted number">{summary}</span>
      </summary>
      <div class="stack">
        <p class="muted">{hint}</p>
        <ExposureFields form={form} exposures={exposures} onChange={(changed) => changes.set(changed)} />
        {problem && <ProblemCard problem={problem} onDismiss={() => changes.save.dismiss()} />}
      </div>
    </details>
  );
}
