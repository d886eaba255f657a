/** Teaching a recipe on a finished scan: region, tool, value at once, limits, publication as the next version. */

import { useCallback, useEffect, useMemo } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { useForm } from "../../components/fields/form";
import { Show, useLoaded } from "../../components/loading/loading";
import { ProblemCard } from "../../components/problem";
import type { CloudViewer } from "../../scene/view/viewer";
import { href, route } from "../../state/browser/route";
import type { Inspection } from "../../state/records/inspections";
import { text } from "../../text";
import { Comparisons } from "../inspections/comparison";
import { MeshTool } from "../result/mesh_tool";
import { findScan } from "../result/result_state";
import type { Scan } from "../result/scan_record";
import { CloudView } from "../viewer/cloud_view";
import { AlignmentCard } from "./alignment/card";
import { ComposedCard } from "./composed_card";
import { PlanCard } from "./plan_card";
import { PublishCard } from "./recipe/publish_card";
import { RecipeCard } from "./recipe/recipe_card";
import { SettingsCard } from "./settings/card";
import { SurfaceCard } from "./surface/card";
import { TeachState } from "./teach_state";
import { ToolCard } from "./tool_card";
import "./teach.css";

export default function Teach() {
  const { api } = useApp();
  const { id, query } = route.value;
  const inspection_id = query.get("inspection") ?? undefined;
  const { state } = useLoaded(async () => {
    const params = { path: { id: inspection_id ?? "" } };
    const inspection = inspection_id ? await data(api.GET("/api/v1/inspections/{id}", { params })) : undefined;
    return { scan: await findScan(api, id ?? inspection?.scan_id ?? undefined), inspection };
  }, [api, id, inspection_id]);
  const words = text.value.teach;
  return (
    <Show of={state}>
      {({ scan, inspection }) =>
        scan ? (
          <TeachOn key={scan.id} scan={scan} inspection={inspection} />
        ) : (
          <section class="card stack">
            <h1>{words.title}</h1>
            <p>{words.no_scan}</p>
            <p>
              <a class="button" href={href("scan")}>
                {text.value.result.go_scan}
              </a>
            </p>
          </section>
        )
      }
    </Show>
  );
}

function TeachOn({ scan, inspection }: { scan: Scan; inspection: Inspection | undefined }) {
  const app = useApp();
  const words = text.value.teach;
  const state = useMemo(() => new TeachState(app, scan, inspection), [app, scan, inspection]);
  const form = useForm();
  const { view } = state.result;
  useEffect(() => {
    view.card.value = "region";
  }, [view]);
  useEffect(() => state.follow(), [state]);
  const onViewer = useCallback((viewer: CloudViewer | undefined) => state.onViewer(viewer), [state]);
  const problem = state.result.problem.value;
  return (
    <div class="stack teach">
      <header class="row">
        <h1 class="grow">{words.title_of(scan.name)}</h1>
        <a class="button" href={inspection ? href("inspections", inspection.id) : href("result", scan.id)}>
          {inspection ? words.to_inspection : words.to_result}
        </a>
      </header>
      <p class="muted">{words.how}</p>
      {problem && <ProblemCard problem={problem} />}
      <div class="teach-page">
        <CloudView
          state={view}
          onViewer={onViewer}
          empty={<p>{text.value.frame.loading}</p>}
          tools={<MeshTool result={state.result} />}
        />
        <div class="stack">
          <RecipeCard recipe={state.recipe} />
          <ToolCard state={state} />
          <ComposedCard state={state} />
          <AlignmentCard state={state} />
          <SurfaceCard state={state} />
        </div>
      </div>
      <PlanCard state={state} form={form} />
      <Comparisons
        results={state.trial.answered.value?.said.results ?? []}
        surface={state.surface}
        reveal={() => view.reveal()}
      />
      <SettingsCard settings={state.recipe.settings} form={form} />
      <PublishCard state={state} form={form} />
    </div>
  );
}
