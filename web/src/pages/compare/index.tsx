/** Two scans side by side, or the difference of their surfaces. */

import { useCallback, useEffect, useMemo } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { Choice, storedOption } from "../../components/fields/choice";
import { Show, useLoaded } from "../../components/loading/loading";
import { ProblemCard } from "../../components/problem";
import type { CloudViewer } from "../../scene/view/viewer";
import { href, replaceQuery, route } from "../../state/browser/route";
import { language, text } from "../../text";
import { dateTime } from "../../units";
import { findScan } from "../result/result_state";
import type { Scan } from "../result/scan_record";
import { CloudView } from "../viewer/cloud_view";
import { CompareState } from "./compare_state";
import "./compare.css";

export default function Compare() {
  const { api } = useApp();
  const { id, query } = route.value;
  const other_id = query.get("with") ?? undefined;
  const { state } = useLoaded(async () => {
    const scans = (await data(api.GET("/api/v1/scans", { params: { query: { limit: 50 } } }))).items;
    const second = await findScan(api, id);
    // Without a choice: the scan before this one.
    const before = scans.find((scan) => second && scan.created_at_ms < second.created_at_ms);
    const first = other_id ? await findScan(api, other_id) : before;
    return { scans, first, second };
  }, [api, id, other_id]);
  const words = text.value.compare;
  return (
    <Show of={state}>
      {({ scans, first, second }) =>
        first && second ? (
          <Comparison key={`${first.id} ${second.id}`} scans={scans} first={first} second={second} />
        ) : (
          <section class="card stack">
            <h1>{words.title}</h1>
            <p>{words.needs_two}</p>
          </section>
        )
      }
    </Show>
  );
}

interface Properties {
  scans: readonly Scan[];
  first: Scan;
  second: Scan;
}

function Comparison({ scans, first, second }: Properties) {
  const app = useApp();
  const words = text.value.compare;
  const state = useMemo(() => new CompareState(app, first, second), [app, first, second]);
  useEffect(() => state.follow(), [state]);
  const difference = route.value.query.get("as") === "difference";
  const surface = state.surface.value;
  useEffect(() => state.showDifference(difference), [state, difference, surface]);
  const onFirst = useCallback((viewer: CloudViewer | undefined) => state.onViewer(0, viewer), [state]);
  const onSecond = useCallback((viewer: CloudViewer | undefined) => state.onViewer(1, viewer), [state]);
  const change = (part: Record<string, string>) => {
    const query = { with: first.id, as: difference ? "difference" : "side", ...part };
    replaceQuery("compare", second.id, query);
  };
  const [one, other] = state.results;
  const problem = one.problem.value ?? other.problem.value;
  return (
    <div class="stack compare">
      <header class="row">
        <h1 class="grow">{words.title}</h1>
        <a class="button" href={href("result", second.id)}>
          {words.to_result(second.name)}
        </a>
      </header>
      <div class="row end">
        <Choice
          label={words.reference}
          value={first.id}
          options={[...(scans.some(({ id }) => id === first.id) ? [] : [first]), ...scans]
            .filter(({ id }) => id !== second.id)
            .map(storedOption)}
          onChange={(id) => change({ with: id })}
        />
        <fieldset class="segments" aria-label={words.as}>
          <button type="button" aria-pressed={!difference} onClick={() => change({ as: "side" })}>
            {words.side_by_side}
          </button>
          <button type="button" aria-pressed={difference} onClick={() => change({ as: "difference" })}>
            {words.difference}
          </button>
        </fieldset>
      </div>
      {difference && <p class="muted">{words.difference_hint}</p>}
      {problem && <ProblemCard problem={problem} />}
      <div class={difference ? "compare-views difference" : "compare-views"}>
        <figure class="first">
          <figcaption>{words.caption(first.name, dateTime(first.created_at_ms, language.value))}</figcaption>
          <CloudView state={one.view} onViewer={onFirst} empty={<p>{text.value.frame.loading}</p>} bare />
        </figure>
        <figure class="second">
          <figcaption>{words.caption(second.name, dateTime(second.created_at_ms, language.value))}</figcaption>
          <CloudView state={other.view} onViewer={onSecond} empty={<p>{text.value.frame.loading}</p>} />
        </figure>
      </div>
    </div>
  );
}
