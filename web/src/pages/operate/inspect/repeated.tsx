/** Asks whether a part that was inspected before is to be inspected again. */

import { CommandButton } from "../../../components/command_button";
import { Dialog } from "../../../components/dialogs/dialog";
import { VerdictWord } from "../../../components/verdict";
import { type Inspection, versionName } from "../../../state/records/inspections";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import type { InspectionRun } from "./inspection_run";

export function Repeated({ run, earlier }: { run: InspectionRun; earlier: Inspection }) {
  const words = text.value.operate;
  const close = () => {
    run.again.dismiss();
    run.repeated.value = undefined;
  };
  return (
    <Dialog title={words.repeated} onClose={close}>
      <div class="stack">
        <p>
          {words.repeated_at(earlier.serial, dateTime(earlier.created_at_ms, language.value))}{" "}
          {versionName(earlier.recipe)}: <VerdictWord verdict={earlier.verdict} />
        </p>
        <p>{words.repeated_question}</p>
        <div class="row">
          {/* The first button has the focus: a scanner's Enter must not inspect the part again. */}
          <button type="button" class="operator" onClick={close}>
            {words.repeated_no}
          </button>
          <CommandButton command={run.again} kind="operator">
            {words.repeated_yes}
          </CommandButton>
        </div>
      </div>
    </Dialog>
  );
}
