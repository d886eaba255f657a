/** The section at one stage position: z over x of one frame, with σ of each point. */

import { useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { Show, useLoaded } from "../../components/loading/loading";
import { orderOfPoint } from "../../scene/plot/nearest";
import { type PlotLabels, ProfilePlot } from "../../scene/plot/profile_plot";
import type { ProfileMessage } from "../../stream/protocol";
import { language, text } from "../../text";
import { orderName } from "../../theme";
import { decimal, length } from "../../units";
import type { Scan } from "./scan_record";
import { sectionOf } from "./section";

/** All orders are visible. */
const ALL_SHOWN: ReadonlySet<number> = new Set();

export function SectionCard({ scan }: { scan: Scan }) {
  const { api } = useApp();
  const words = text.value.result;
  const { state } = useLoaded(
    async () => (await data(api.GET("/api/v1/scans/{id}/profiles", { params: { path: { id: scan.id } } }))).items,
    [api, scan.id],
  );
  return (
    <section class="card stack section-card" aria-label={words.section}>
      <h2>{words.section}</h2>
      <Show of={state}>
        {(frames) => (frames.length === 0 ? <p>{words.section_none}</p> : <Section scan={scan} frames={frames} />)}
      </Show>
    </section>
  );
}

interface FramePosition {
  sequence: number;
  position_mm?: number | null;
  angle_deg?: number | null;
}

function Section({ scan, frames }: { scan: Scan; frames: readonly FramePosition[] }) {
  const { api } = useApp();
  const words = text.value.result;
  const chosen = useSignal(frames.length >> 1);
  const frame = frames[chosen.value];
  const sequence = frame?.sequence ?? 0;
  const { state } = useLoaded(
    async () => {
      const path = { id: scan.id, sequence };
      return sectionOf(await data(api.GET("/api/v1/scans/{id}/profiles/{sequence}", { params: { path } })));
    },
    [api, scan.id],
    [sequence],
  );
  const angle_deg = frame?.angle_deg;
  const position =
    angle_deg == null
      ? `${decimal(frame?.position_mm ?? 0, 2, language.value)} mm`
      : `${decimal(angle_deg, 2, language.value)}°`;
  return (
    <>
      <label class="field">
        <span>
          {words.section_at} <b class="number">{position}</b>
        </span>
        <input
          type="range"
          min={0}
          max={frames.length - 1}
          value={chosen.value}
          aria-valuetext={position}
          onInput={(event) => {
            chosen.value = event.currentTarget.valueAsNumber;
          }}
        />
      </label>
      <Plot profile={state.value.value} />
      <Show of={state}>{() => null}</Show>
    </>
  );
}

function plotLabels(): PlotLabels {
  const chosen = language.value;
  const number = (value: number) => value.toLocaleString(chosen, { maximumFractionDigits: 3 }).replace("-", "−");
  return { ...text.value.live.plot, number };
}

function Plot({ profile }: { profile: ProfileMessage | undefined }) {
  const area = useRef<HTMLDivElement>(null);
  const plot = useRef<ProfilePlot | undefined>(undefined);
  const pointed = useSignal<number | undefined>(undefined);
  useEffect(() => {
    if (!area.current) return;
    const made = new ProfilePlot(area.current, plotLabels(), ALL_SHOWN, (idx) => {
      pointed.value = idx;
      made.mark(idx);
    });
    plot.current = made;
    return () => made.dispose();
  }, [pointed]);
  useEffect(() => {
    plot.current?.show(profile);
    plot.current?.mark(undefined);
    pointed.value = undefined;
  }, [profile, pointed]);
  useSignalEffect(() => plot.current?.setLabels(plotLabels()));
  return (
    <>
      <div class="data-view section-plot">
        <div
          ref={area}
          class="section-area"
          // biome-ignore lint/a11y/noNoninteractiveTabindex: keys move the cursor along the section
          tabIndex={0}
          role="application"
          aria-label={text.value.result.section}
        />
      </div>
      {profile && <PointLine profile={profile} idx={pointed.value} />}
    </>
  );
}

/** The values of the point at the pointer, or a hint. */
function PointLine({ profile, idx }: { profile: ProfileMessage; idx: number | undefined }) {
  const words = text.value.result;
  const chosen = language.value;
  if (idx === undefined) return <p class="muted section-hint">{words.section_hint(profile.z_mm.length)}</p>;
  const order = orderOfPoint(profile, idx);
  const at = (numbers: Float32Array) => `${decimal(numbers[idx] ?? 0, 3, chosen)} mm`;
  return (
    <p class="number section-point">
      <span>{order === undefined ? "" : `${words.order} ${orderName(order)}`}</span>
      <span>x {at(profile.x_mm)}</span>
      <span>y {at(profile.y_mm)}</span>
      <span>z {at(profile.z_mm)}</span>
      <span>σ {length(profile.sigma_mm[idx] ?? 0, chosen)}</span>
    </p>
  );
}
