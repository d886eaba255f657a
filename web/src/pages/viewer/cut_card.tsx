/** A cut through the cloud: position, thickness, the points in it as a plot, and the distance of two of them. */

import { useSignal, useSignalEffect } from "@preact/signals";
import { useId, useLayoutEffect, useRef } from "preact/hooks";
import { Check } from "../../components/fields/check";
import { useForm } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { type CutProfile, distanceInCut } from "../../scene/cloud/cut";
import { AXES, AXIS_NAMES, type Cut } from "../../scene/cloud/space";
import { type PlotLabels, ProfilePlot } from "../../scene/plot/profile_plot";
import { language, text } from "../../text";
import { count, decimal } from "../../units";
import type { ViewState } from "./view_state";

/** Steps of the slider over the extent of the cloud. */
const SLIDER_STEPS = 400;

/** All orders are visible. */
const ALL_SHOWN: ReadonlySet<number> = new Set();

/** A press with less movement is a click, CSS px; a longer one zooms the plot. */
const CLICK_PX = 4;

export function CutCard({ state }: { state: ViewState }) {
  const words = text.value.viewer;
  const cut = state.cut.value;
  return (
    <section class="card stack cut-card" aria-label={words.cut}>
      <div class="row">
        <h2 class="grow">{words.cut}</h2>
        <fieldset class="segments" aria-label={words.cut_axis}>
          {AXES.map((axis) => (
            <button
              key={axis}
              type="button"
              aria-pressed={cut?.axis === axis}
              onClick={() => state.cutThrough(axis)}
            >
              {words.across(AXIS_NAMES[axis])}
            </button>
          ))}
        </fieldset>
        {cut && (
          <button type="button" onClick={() => state.clearCut()}>
            {words.clear_cut}
          </button>
        )}
      </div>
      {cut && <CutFields state={state} cut={cut} />}
      {state.cut_profile.value && <CutPlot state={state} shown={state.cut_profile.value} />}
    </section>
  );
}

function CutFields({ state, cut }: { state: ViewState; cut: Cut }) {
  const words = text.value.viewer;
  const form = useForm();
  const id = useId();
  const [low, high] = state.extent(cut.axis);
  const change = (part: Partial<Cut>) => {
    state.cut_picks.value = [];
    state.cut.value = { ...cut, ...part };
  };
  const name = AXIS_NAMES[cut.axis];
  return (
    <div class="row end">
      <div class="field grow">
        <label for={id}>{words.cut_at(name)}</label>
        <input
          id={id}
          type="range"
          min={low}
          max={high}
          step={(high - low) / SLIDER_STEPS}
          value={cut.at_mm}
          aria-valuetext={`${decimal(cut.at_mm, 2, language.value)} mm`}
          onInput={(event) => change({ at_mm: Number(event.currentTarget.valueAsNumber.toFixed(2)) })}
        />
      </div>
      <NumberField
        form={form}
        label={name}
        unit="mm"
        value={cut.at_mm}
        onChange={(at_mm) => at_mm !== undefined && change({ at_mm })}
      />
      <NumberField
        form={form}
        label={words.thickness}
        unit="mm"
        value={cut.thickness_mm}
        min={0.01}
        onChange={(thickness_mm) => thickness_mm !== undefined && change({ thickness_mm })}
      />
      <Check label={words.cut_hides(name)} checked={cut.hides} onChange={(hides) => change({ hides })} />
    </div>
  );
}

function plotLabels(shown: CutProfile | undefined): PlotLabels {
  const chosen = language.value;
  const number = (value: number) => value.toLocaleString(chosen, { maximumFractionDigits: 3 }).replace("-", "−");
  return { along: (axis) => `${axis}, mm`, z: `${shown?.up ?? "z"}, mm`, number };
}

function CutPlot({ state, shown }: { state: ViewState; shown: CutProfile }) {
  const words = text.value.viewer;
  const area = useRef<HTMLDivElement>(null);
  const plot = useRef<ProfilePlot | undefined>(undefined);
  const pointed = useSignal<number | undefined>(undefined);
  const picked = useSignal<readonly number[]>([]);
  const pressed = useRef<{ x: number; y: number } | undefined>(undefined);
  // Before the browser handles the next key, which moves the cursor along the points.
  useLayoutEffect(() => {
    if (!area.current) return;
    const made = new ProfilePlot(area.current, plotLabels(undefined), ALL_SHOWN, (idx) => {
      pointed.value = idx;
      made.mark(idx);
    });
    plot.current = made;
    return () => made.dispose();
  }, [pointed]);
  useLayoutEffect(() => {
    plot.current?.show(shown.profile);
    plot.current?.setLabels(plotLabels(shown));
    plot.current?.mark(undefined);
    plot.current?.pin([]);
    pointed.value = undefined;
    picked.value = [];
  }, [shown, pointed, picked]);
  useSignalEffect(() => plot.current?.setLabels(plotLabels(state.cut_profile.value)));
  const pick = () => {
    const idx = pointed.peek();
    if (idx === undefined) return;
    picked.value = picked.peek().length >= 2 ? [idx] : [...picked.peek(), idx];
    plot.current?.pin(picked.peek());
    state.cut_picks.value = picked
      .peek()
      .map((one) => shown.at[one])
      .filter((at) => at !== undefined);
  };
  return (
    <>
      <div class="data-view section-plot cut-plot">
        <div
          ref={area}
          class="section-area"
          // biome-ignore lint/a11y/noNoninteractiveTabindex: keys move the cursor along the cut
          tabIndex={0}
          role="application"
          aria-label={words.cut_plot}
          onPointerDown={(event) => {
            pressed.current = { x: event.clientX, y: event.clientY };
          }}
          onPointerUp={(event) => {
            const from = pressed.current;
            if (from && Math.hypot(event.clientX - from.x, event.clientY - from.y) < CLICK_PX) pick();
          }}
          onKeyDown={(event) => {
            if (event.key === "Enter") pick();
          }}
        />
      </div>
      <CutDistance state={state} shown={shown} />
    </>
  );
}

function CutDistance({ state, shown }: { state: ViewState; shown: CutProfile }) {
  const words = text.value.viewer;
  const [from, to] = state.cut_picks.value;
  const axis = state.cut.value?.axis;
  const mm = (value: number) => `${decimal(value, 3, language.value)} mm`;
  if (!from || !to || axis === undefined) {
    return <p class="muted section-hint">{words.cut_hint(count(shown.at.length, language.value))}</p>;
  }
  const { distance_mm, across_mm, up_mm } = distanceInCut(axis, from, to);
  return (
    <dl class="facts" data-cut-distance={distance_mm.toFixed(3)}>
      <dt>{words.distance_in_cut}</dt>
      <dd>
        <strong>{mm(distance_mm)}</strong> (Δ{shown.across} {mm(across_mm)}, Δ{shown.up} {mm(up_mm)})
      </dd>
    </dl>
  );
}
