/** The report of a result: printed, as PDF, or as JSON. */

import { signal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import type { CloudViewer } from "../../scene/view/viewer";
import { Command } from "../../state/station/command";
import { language, text } from "../../text";
import { dateTime } from "../../units";
import { download } from "../health/bundle";
import { PrintedLegend } from "../viewer/legend";
import type { ResultState } from "./result_state";

/** Format of the file. */
const FORMAT = "sheaf-result/1";

/** Image of the point cloud when the report was created, as a data URL. */
const printed = signal<string | undefined>(undefined);

interface Properties {
  result: ResultState;
  viewer: () => CloudViewer | undefined;
}

export function ReportCard({ result, viewer }: Properties) {
  const words = text.value.result;
  const print = useMemo(
    () =>
      new Command(async () => {
        printed.value = viewer()?.snapshot();
        const image = new Image();
        image.src = printed.value ?? "";
        await image.decode().catch(() => undefined);
        window.print();
      }),
    [viewer],
  );
  return (
    <section class="card stack report-card" aria-label={words.report_title}>
      <h2>{words.report_title}</h2>
      <div class="row">
        <CommandButton command={print}>{words.print}</CommandButton>
        <button type="button" onClick={() => download(`${result.scan.name}.json`, reportJson(result))}>
          JSON
        </button>
      </div>
    </section>
  );
}

/** Printed only: the image of the point cloud with its legend, and the date of the report. */
export function Printed({ result, viewer }: Properties) {
  useEffect(() => {
    // Also for printing from the browser's menu.
    const take = () => {
      printed.value = viewer()?.snapshot() ?? printed.peek();
    };
    addEventListener("beforeprint", take);
    return () => {
      removeEventListener("beforeprint", take);
      printed.value = undefined;
    };
  }, [viewer]);
  const simulated = useApp().station.simulated.value;
  return (
    <div class="print-only">
      {simulated && <strong>{text.value.frame.simulated[simulated] ?? simulated}</strong>}
      {printed.value && <img src={printed.value} alt={text.value.viewer.title} />}
      {printed.value && <PrintedLegend state={result.view} />}
      <p>
        Sheaf · {text.value.result.printed_at} {dateTime(Date.now(), language.value)}
      </p>
    </div>
  );
}

/** The scan record and its measurements. */
function reportJson(result: ResultState): unknown {
  const measurements = result.measurements.peek();
  return { format: FORMAT, verdict: result.verdict.peek() ?? null, scan: result.scan, measurements };
}
