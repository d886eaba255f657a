/** The cloud of the inspected part with its characteristics; the table and the cloud point at each other. */

import { useCallback, useEffect } from "preact/hooks";
import { ProblemCard } from "../../components/problem";
import type { CloudViewer } from "../../scene/view/viewer";
import { text } from "../../text";
import { MeshTool } from "../result/mesh_tool";
import { CloudView } from "../viewer/cloud_view";
import type { PartState } from "./part_state";

export function PartCard({ state }: { state: PartState }) {
  const words = text.value.inspections;
  useEffect(() => state.follow(), [state]);
  const onViewer = useCallback((viewer: CloudViewer | undefined) => state.onViewer(viewer), [state]);
  const problem = state.result.problem.value;
  return (
    <div class="stack part-card">
      {problem && <ProblemCard problem={problem} />}
      <CloudView
        state={state.result.view}
        onViewer={onViewer}
        empty={<p>{text.value.frame.loading}</p>}
        tools={<MeshTool result={state.result} />}
      />
      <p class="muted">{words.part_hint}</p>
    </div>
  );
}
