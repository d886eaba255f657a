/** The report of a calibration as a page, and its certificate as a file. */

import { useMemo } from "preact/hooks";
import { bytes } from "../../../api/client";
import { CommandButton } from "../../../components/command_button";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { save } from "../../health/bundle";

export function Reports({ id }: { id: string }) {
  const words = text.value.calibration;
  const report = `/api/v1/calibrations/${id}/report`;
  // Requested here, so that a refusal is shown with its remedy.
  const certificate = useMemo(
    () =>
      new Command(async () => {
        const response = await bytes(`${report}?format=dcc`);
        save(`calibration-${id}.xml`, await response.blob());
      }),
    [report, id],
  );
  return (
    <section class="stack" aria-label={words.report_short}>
      <h3>{words.report_short}</h3>
      <div class="row">
        <a class="button" href={report} target="_blank" rel="noreferrer">
          {words.report}
        </a>
        <CommandButton command={certificate}>{words.certificate}</CommandButton>
      </div>
      <p class="muted">{words.certificate_hint}</p>
    </section>
  );
}
