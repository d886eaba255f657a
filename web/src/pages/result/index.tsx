/** The result page: verdict, point cloud, mesh, measurements, section, provenance of a scan. */

import { useCallback, useEffect, useMemo, useRef } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { Show, useLoaded } from "../../components/loading/loading";
import { ProblemCard } from "../../components/problem";
import { VerdictWord } from "../../components/verdict";
import type { CloudViewer } from "../../scene/view/viewer";
import { goTo, href, route } from "../../state/browser/route";
import { language, text } from "../../text";
import { dateTime } from "../../units";
import { CloudView } from "../viewer/cloud_view";
import { Measurements } from "./measurements";
import { MeshTool } from "./mesh_tool";
import { Downloads, Provenance, Recompute } from "./provenance";
import { Printed, ReportCard } from "./report";
import { findScan, ResultState } from "./result_state";
import type { Scan } from "./scan_record";
import { SectionCard } from "./section_card";
import "./result.css";

export default function Result() {
  const { api } = useApp();
  const id = route.value.id;
  const { state } = useLoaded(async () => ({ scan: await findScan(api, id) }), [api, id]);
  const words = text.value.result;
  return (
    <Show of={state}>
      {({ scan }) =>
        scan ? (
          <ScanResult key={scan.id} scan={scan} />
        ) : (
          <div class="card stack">
            <h1>{words.title}</h1>
            <p>{words.no_scan}</p>
            <p>
              <a class="button" href={href("scan")}>
                {words.go_scan}
              </a>
            </p>
          </div>
        )
      }
    </Show>
  );
}

function ScanResult({ scan }: { scan: Scan }) {
  const app = useApp();
  const words = text.value.result;
  const result = useMemo(() => new ResultState(app, scan), [app, scan]);
  useEffect(() => result.follow(), [result]);
  const end_feed = useRef<(() => void) | undefined>(undefined);
  const shown = useRef<CloudViewer | undefined>(undefined);
  const viewer = useCallback(() => shown.current, []);
  const onViewer = useCallback(
    (viewer: CloudViewer | undefined) => {
      shown.current = viewer;
      end_feed.current?.();
      end_feed.current = viewer && result.feed(viewer);
    },
    [result],
  );
  return (
    <>
      <header class="result-head">
        <div class="stack">
          <h1>{scan.name}</h1>
          <span class="muted">
            {words.title} · {dateTime(scan.created_at_ms, language.value)}
          </span>
        </div>
        {scan.purpose === "verification" && <span class="tag">{text.value.results.verification}</span>}
        {scan.state !== "complete" && <span class="tag bad">{words.states[scan.state] ?? scan.state}</span>}
        <span class="grow" />
        <div class="overall">
          {result.verdict.value ? (
            <VerdictWord verdict={result.verdict.value} big />
          ) : (
            <span class="muted">{words.no_verdict}</span>
          )}
        </div>
        <ScanChoice scan={scan} />
        <a class="button" href={href("compare", scan.id)}>
          {words.compare}
        </a>
        <a class="button" href={href("teach", scan.id)}>
          {text.value.teach.title}
        </a>
      </header>
      {result.problem.value && <ProblemCard problem={result.problem.value} />}
      {scan.state !== "complete" && (
        <p class="note">
          {words.state_hints[scan.state] ?? scan.state} <span lang="en">{scan.report.losses?.join("; ")}</span>
        </p>
      )}
      <div class="result-page">
        <CloudView
          state={result.view}
          onViewer={onViewer}
          empty={<p>{scan.report.n_frames === 0 ? words.no_rows : text.value.frame.loading}</p>}
          tools={<MeshTool result={result} />}
        />
        <div class="stack">
          <Printed result={result} viewer={viewer} />
          <Measurements result={result} />
          <SectionCard scan={scan} />
        </div>
        <div class="stack">
          <Provenance scan={scan} n_shown={result.view.n_points.value} />
          <ReportCard result={result} viewer={viewer} />
          <Downloads scan={scan} />
          <Recompute result={result} />
        </div>
      </div>
    </>
  );
}

/** Selects another scan. */
function ScanChoice({ scan }: { scan: Scan }) {
  const { api } = useApp();
  const { state } = useLoaded(
    async () => (await data(api.GET("/api/v1/scans", { params: { query: { limit: 50 } } }))).items,
    [api, scan.id],
  );
  const scans = state.value.value ?? [];
  return (
    <label class="field scan-choice">
      <span>{text.value.result.other_scan}</span>
      <select value={scan.id} onChange={(event) => goTo("result", event.currentTarget.value)}>
        {!scans.some(({ id }) => id === scan.id) && <option value={scan.id}>{scan.name}</option>}
        {scans.map(({ id, name, created_at_ms }) => (
          <option key={id} value={id}>
            {name} · {dateTime(created_at_ms, language.value)}
          </option>
        ))}
      </select>
    </label>
  );
}
