/** The point cloud with its tools: colours, views, legend, picked points. */

import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { selected } from "../../components/fields/selected";
import { COLOUR_MODES } from "../../scene/colours";
import type { ViewName } from "../../scene/view/orbit";
import { CloudViewer } from "../../scene/view/viewer";
import { language, text } from "../../text";
import { count } from "../../units";
import { CutCard } from "./cut_card";
import { useFullView } from "./full_view";
import { Legend } from "./legend";
import { Picks } from "./picks";
import { RegionCard } from "./region_card";
import type { ViewerCard, ViewState } from "./view_state";
import "./viewer.css";

interface Properties {
  state: ViewState;
  /** Called with the viewer when it is created, and with `undefined` when it is disposed. */
  onViewer: (viewer: CloudViewer | undefined) => void;
  /** Shown while there are no points. */
  empty: ComponentChildren;
  /** Additional tools of the page. */
  tools?: ComponentChildren;
  /** Whether only the cloud is shown, because another view has the tools and the legend. */
  bare?: boolean;
}

const SHOWN = ["cloud", "mesh", "both"] as const;

const VIEWS: readonly ViewName[] = ["iso", "front", "top", "side"];

export function CloudView({ state, onViewer, empty, tools, bare }: Properties) {
  const host = useRef<HTMLDivElement>(null);
  const viewer = useRef<CloudViewer | undefined>(undefined);
  const failed = useRef(false);
  useEffect(() => {
    if (!host.current) return;
    const made = makeViewer(host.current, state);
    failed.current = made === undefined;
    if (!made) {
      state.lost.value = true;
      return;
    }
    viewer.current = made;
    const detach = state.attach(made);
    onViewer(made);
    return () => {
      onViewer(undefined);
      detach();
      made.dispose();
    };
  }, [state, onViewer]);
  const words = text.value.viewer;
  useFullView(state, !bare);
  const points = count(state.n_points.value, language.value);
  useEffect(() => {
    viewer.current?.canvas.setAttribute("role", "application");
    viewer.current?.canvas.setAttribute("aria-label", words.described(points));
  });
  return (
    <section class={state.full.value ? "cloud-view full" : "cloud-view"} aria-label={words.title}>
      {!bare && <Toolbar state={state} viewer={() => viewer.current} tools={tools} />}
      {!bare && state.card.value === "region" && <RegionCard state={state} />}
      <div class="data-view cloud-stage live-data">
        <div class="cloud-canvas" ref={host} />
        {state.n_points.value === 0 && <div class="cloud-empty">{empty}</div>}
        {state.lost.value && (
          <div class="cloud-empty" role="status">
            {failed.current ? words.no_webgl : words.context_lost}
          </div>
        )}
        <details class="cloud-keys">
          <summary>{words.keys}</summary>
          <dl>
            {words.key_list.map(([keys, what]) => (
              <div key={keys}>
                <dt>{keys}</dt>
                <dd>{what}</dd>
              </div>
            ))}
          </dl>
        </details>
        <span class="cloud-count" data-points={state.n_points.value}>
          {state.n_shown.value === undefined
            ? words.points(points)
            : words.points_of(count(state.n_shown.value, language.value), points)}
        </span>
      </div>
      {!bare && <Legend state={state} />}
      {!bare && state.card.value === "cut" && <CutCard state={state} />}
      <Picks state={state} />
    </section>
  );
}

function makeViewer(host: HTMLDivElement, state: ViewState): CloudViewer | undefined {
  try {
    return new CloudViewer(host, {
      onGrown: (cloud) => state.pointsAdded(cloud.n_points),
      onPicked: (picked) => void state.pick(picked),
      onCleared: () => state.clearPicks(),
      onProjection: (orthographic) => {
        state.orthographic.value = orthographic;
      },
      onRegion: (region) => state.regionSelected(region),
      onLabel: (id) => state.onLabel?.(id),
      onMoved: () => state.onMoved?.(),
      onContext: (lost) => {
        state.lost.value = lost;
      },
    });
  } catch {
    return undefined;
  }
}

interface ToolbarProperties {
  state: ViewState;
  viewer: () => CloudViewer | undefined;
  tools: ComponentChildren;
}

function Toolbar({ state, viewer, tools }: ToolbarProperties) {
  const words = text.value.viewer;
  return (
    <div class="row cloud-tools" role="toolbar" aria-label={words.tools}>
      <label class="row">
        <span class="muted">{words.colour}</span>
        <select
          value={state.mode.value}
          onChange={(event) => {
            state.mode.value = selected(event, COLOUR_MODES) ?? state.mode.value;
          }}
        >
          {COLOUR_MODES.map((mode) => (
            <option key={mode} value={mode} disabled={mode === "deviation" && !state.feature.value}>
              {words.modes[mode]}
            </option>
          ))}
        </select>
      </label>
      {state.mesh.value && (
        <label class="row">
          <span class="muted">{words.show}</span>
          <select
            value={state.shown.value}
            onChange={(event) => {
              state.shown.value = selected(event, SHOWN) ?? state.shown.value;
            }}
          >
            {SHOWN.map((what) => (
              <option key={what} value={what}>
                {words.shown[what]}
              </option>
            ))}
          </select>
        </label>
      )}
      {tools}
      <ViewTools state={state} />
      <span class="grow" />
      <fieldset class="segments" aria-label={words.view}>
        {VIEWS.map((name) => (
          <button key={name} type="button" onClick={() => viewer()?.view(name)}>
            {words.views[name]}
          </button>
        ))}
      </fieldset>
      <fieldset class="segments" aria-label={words.projection}>
        <button type="button" onClick={() => viewer()?.fit()}>
          {words.fit}
        </button>
        <button
          type="button"
          aria-pressed={state.orthographic.value}
          onClick={() => viewer()?.toggleOrthographic()}
        >
          {words.orthographic}
        </button>
        <button
          type="button"
          aria-pressed={state.z_up.value}
          onClick={() => (state.z_up.value = !state.z_up.peek())}
        >
          {words.z_up}
        </button>
      </fieldset>
    </div>
  );
}

function ViewTools({ state }: { state: ViewState }) {
  const words = text.value.viewer;
  const toggleCard = (card: ViewerCard) => {
    state.card.value = state.card.peek() === card ? undefined : card;
    if (state.card.peek() === "cut" && !state.cut.peek()) state.cutThrough(1);
  };
  return (
    <fieldset class="segments" aria-label={words.parts}>
      <button
        type="button"
        aria-pressed={state.shaded.value}
        onClick={() => (state.shaded.value = !state.shaded.peek())}
      >
        {words.shading}
      </button>
      <button
        type="button"
        aria-pressed={state.dimensions.value}
        onClick={() => (state.dimensions.value = !state.dimensions.peek())}
      >
        {words.dimensions}
      </button>
      <button
        type="button"
        aria-pressed={state.card.value === "region"}
        aria-expanded={state.card.value === "region"}
        onClick={() => toggleCard("region")}
      >
        {words.region}
      </button>
      <button
        type="button"
        aria-pressed={state.card.value === "cut"}
        aria-expanded={state.card.value === "cut"}
        onClick={() => toggleCard("cut")}
      >
        {words.cut}
      </button>
      <button
        type="button"
        aria-pressed={state.full.value}
        aria-keyshortcuts="F11"
        onClick={() => (state.full.value = !state.full.peek())}
      >
        {words.full}
      </button>
    </fieldset>
  );
}
