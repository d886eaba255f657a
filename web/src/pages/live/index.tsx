/** The live page: camera image, detected lines, profile, quality, manual control. */

import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { useApp } from "../../app";
import { activityOf } from "../../components/job/job_text";
import { DarkFrameCard } from "../../components/station/dark_frame_card";
import type { PlotLabels } from "../../scene/plot/profile_plot";
import { href } from "../../state/browser/route";
import { letter_shortcuts } from "../../state/browser/shortcuts";
import { language, text } from "../../text";
import { CameraCard } from "./controls/camera_card";
import { LightCard } from "./controls/light_card";
import { StageCard } from "./controls/stage_card";
import { FrameFacts } from "./image/frame_facts";
import { ReadoutLine } from "./image/readout_line";
import { Snapshot } from "./image/snapshot";
import { NoProfile, StartHere } from "./image/start_here";
import { Toolbar, ZoomButtons } from "./image/toolbar";
import { LiveView } from "./live_view";
import { QualityTable } from "./quality/quality_table";
import { RecordingsCard } from "./recordings/recordings_card";
import "./live.css";

export default function Live() {
  const { stream } = useApp();
  const image = useRef<HTMLDivElement>(null);
  const plot = useRef<HTMLDivElement>(null);
  const histogram = useRef<HTMLCanvasElement>(null);
  const view = useSignal<LiveView | undefined>(undefined);
  const words = text.value.live;

  useEffect(() => {
    if (!image.current || !plot.current || !histogram.current) return;
    const containers = { image: image.current, plot: plot.current, histogram: histogram.current };
    const made = new LiveView(stream, containers, plotLabels());
    view.value = made;
    const onKey = (event: KeyboardEvent) => handleKey(event, made);
    addEventListener("keydown", onKey);
    return () => {
      removeEventListener("keydown", onKey);
      made.dispose();
    };
  }, [stream, view]);
  useEffect(() => view.value?.setLabels(plotLabels()), [view, words]);

  return (
    <div class="live">
      <header>
        <h1 class="grow">{words.title}</h1>
        {view.value && <Snapshot view={view.value} />}
      </header>
      <Notes view={view.value} />
      <div class="live-columns">
        <section class="live-data stack views" aria-label={words.title}>
          <div class="card views-card">
            {view.value && <Toolbar view={view.value} />}
            <div class="data-view image-place">
              {/* biome-ignore lint/a11y/noNoninteractiveTabindex: keys zoom and move the image */}
              <div ref={image} class="image-area" tabIndex={0} role="application" aria-label={words.image} />
              {view.value && <ZoomButtons view={view.value} />}
              {view.value && <StartHere view={view.value} />}
            </div>
            {view.value && <ReadoutLine view={view.value} />}
            <div class="data-view plot-place">
              <div
                ref={plot}
                class="plot-area"
                // biome-ignore lint/a11y/noNoninteractiveTabindex: keys move the cursor along the profile
                tabIndex={0}
                role="application"
                aria-label={words.profile}
              />
              {view.value && <NoProfile view={view.value} />}
            </div>
            {view.value && <FrameFacts view={view.value} />}
          </div>
          {view.value && <QualityTable view={view.value} />}
        </section>
        <aside class="stack controls" aria-label={words.controls}>
          <LightCard />
          <CameraCard view={view.value} histogram={histogram} />
          <StageCard />
          <DarkFrameCard />
          <RecordingsCard />
        </aside>
      </div>
    </div>
  );
}

/** Labels and number format of the plot in the chosen language. */
function plotLabels(): PlotLabels {
  const chosen = language.peek();
  const number = (value: number) => value.toLocaleString(chosen, { maximumFractionDigits: 3 }).replace("-", "−");
  return { ...text.peek().live.plot, number };
}

/** Notes on the displayed frame. */
function Notes({ view }: { view: LiveView | undefined }) {
  const { station, jobs } = useApp();
  const words = text.value.live;
  const status = station.status.value;
  const values = view?.values.value;
  return (
    <div class="stack notes">
      {status?.job_id != null && (
        <div class="note">
          {words.job_running(activityOf(status, jobs.get(status.job_id)))}{" "}
          <a href={href("jobs")}>{text.value.pages.jobs}</a>
        </div>
      )}
      {values && !values.calibrated && (
        <div class="note">
          {words.not_calibrated} <a href={href("calibration")}>{words.to_calibration}</a>
        </div>
      )}
    </div>
  );
}

/** Handles single-key shortcuts, except in fields. */
function handleKey(event: KeyboardEvent, view: LiveView): void {
  // Users of speech input or barcode scanners turn single-key shortcuts off.
  if (!letter_shortcuts.peek()) return;
  const target = event.target instanceof Element ? event.target : undefined;
  if (event.ctrlKey || event.metaKey || event.altKey || target?.closest("input, select, textarea, dialog")) return;
  if (event.key === "f" || event.key === "F") view.freeze(!view.frozen.peek());
  else if (event.key === " " && !target?.closest("button, a")) {
    event.preventDefault();
    view.freeze(!view.frozen.peek());
  } else if (event.key === "z" || event.key === "Z") view.showZebra(!view.zebra.peek());
  else if (/^[1-9]$/.test(event.key)) {
    const order = view.orders.peek()[Number(event.key) - 1];
    if (order !== undefined) view.toggleOrder(order);
  }
}
