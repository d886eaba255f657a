/** The scan page: settings, scan plan, progress, growing point cloud. */

import { useCallback, useEffect, useMemo, useRef } from "preact/hooks";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { useForm } from "../../components/fields/form";
import { SceneChoice } from "../../components/scene_choice";
import { useHalted } from "../../components/station/halted";
import { exactPoint } from "../../scene/cloud/exact_point";
import type { CloudViewer } from "../../scene/view/viewer";
import { text } from "../../text";
import { CloudView } from "../viewer/cloud_view";
import { ViewState } from "../viewer/view_state";
import { SetUpForm } from "./form";
import { PlanCard, usePlan } from "./plan_card";
import { RunCard } from "./run_card";
import { ScanRun } from "./scan_run";
import { SetUp } from "./set_up";
import "./scan.css";

export default function Scan() {
  const app = useApp();
  const words = text.value.scan;
  const set_up = useMemo(() => new SetUp(app.station.rotary), [app]);
  const run = useMemo(() => new ScanRun(app, set_up), [app, set_up]);
  const view = useMemo(
    () => new ViewState(async (picked) => await exactPoint(app.api, run.scan_id.peek() ?? "", picked)),
    [app, run],
  );
  useEffect(() => run.follow(), [run]);
  const end_feed = useRef<(() => void) | undefined>(undefined);
  const onViewer = useCallback(
    (viewer: CloudViewer | undefined) => {
      end_feed.current?.();
      end_feed.current = viewer && run.feed(viewer);
    },
    [run],
  );
  const form = useForm();
  const wrong = form.blocked.value;
  const plan = usePlan(set_up);
  return (
    <>
      <header>
        <h1>{words.title}</h1>
      </header>
      <div class="scan-page">
        <div class="stack scan-side">
          <section class="card" aria-label={words.set_up}>
            <h2>{words.set_up}</h2>
            <div class="stack">
              <SceneChoice busy={run.open.value} />
              <SetUpForm set_up={set_up} form={form} />
            </div>
          </section>
          <PlanCard plan={plan} wrong={wrong} />
          <div class="scan-start">
            <CommandButton
              command={run.start}
              kind="primary operator"
              blocked={blockedWhy(run, wrong, plan.problem !== undefined)}
            >
              {words.start}
            </CommandButton>
          </div>
        </div>
        <div class="stack scan-main">
          <RunCard run={run} />
          <CloudView
            state={view}
            onViewer={onViewer}
            empty={<p>{run.open.value ? words.waiting_for_points : words.no_points}</p>}
          />
        </div>
      </div>
    </>
  );
}

/** Why a scan cannot start now. */
function blockedWhy(run: ScanRun, wrong: string | undefined, refused: boolean): string | undefined {
  const { station, control } = useApp();
  const words = text.value.scan;
  const halted = useHalted();
  if (halted) return halted;
  if (run.open.value) return words.blocked_running;
  if (station.stale.value) return words.blocked_stale;
  const other = control.other.value;
  if (other) return words.blocked_other(other);
  if (wrong) return wrong;
  return refused ? words.blocked_plan : undefined;
}
