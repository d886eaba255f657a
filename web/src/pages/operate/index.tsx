/** The operator page, for use with gloves and from a distance: recipe, serial number, Start, verdict, last parts. */

import type { Job } from "../../api/client";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { DamagedRecords } from "../../components/dialogs/damaged";
import { useAutoReloaded } from "../../components/loading/auto_reloaded";
import { ProblemCard } from "../../components/problem";
import { remembered } from "../../state/browser/remembered";
import { href } from "../../state/browser/route";
import { readRecipes } from "../../state/records/recipes";
import { text } from "../../text";
import { choiceOf } from "./inspect/choice";
import { InspectView } from "./inspect/inspect_view";
import { QueueHold } from "./inspect/queue_hold";
import { RecipeBar } from "./inspect/recipe_bar";
import { obstacleOf } from "./readiness";
import { ScanView } from "./scan_view";
import "./operate.css";

/** The recipe last chosen in this browser. */
const stored_choice = remembered("operate_recipe", "");

export default function Operate() {
  const { api, station, jobs } = useApp();
  const words = text.value.operate;
  const active = useAutoReloaded(
    () => data(api.GET("/api/v1/calibrations/active")),
    (event) => event.kind.startsWith("calibration."),
  );
  const recipes = useAutoReloaded(
    () => readRecipes(api),
    ({ kind }) => kind.startsWith("recipe."),
  );
  const queue = useAutoReloaded(
    () => data(api.GET("/api/v1/inspection-queue")),
    ({ kind }) => kind.startsWith("inspections."),
  );
  const { value: hold, problem: unknown_hold } = queue.state.value;
  const { value: known, problem } = recipes.state.value;
  const choice = choiceOf(known?.items ?? [], stored_choice.value);
  const by_recipe = choice.kind !== "scan_only";
  const calibration = active.state.value.value;
  const job =
    jobs.open.value.find((job) => job.id === station.status.value?.job_id) ?? waiting(jobs.open.value, by_recipe);
  const obstacle = obstacleOf({
    stale: station.stale.value,
    status: station.status.value,
    calibrated: calibration === undefined ? undefined : calibration.calibration_id != null,
    busy: job !== undefined,
  });
  return (
    <div class="operate">
      <h1 class="visually-hidden">{words.title}</h1>
      {problem && <ProblemCard problem={problem} />}
      <DamagedRecords rows={known?.damaged ?? []} />
      {known && known.items.length > 0 && (
        <RecipeBar recipes={known.items} choice={choice} onChoose={(next) => (stored_choice.value = next)}>
          <QueueHold hold={hold} problem={unknown_hold} reload={queue.reload} />
        </RecipeBar>
      )}
      {!known && !problem && <p class="muted">{text.value.frame.loading}</p>}
      {(known || problem) &&
        (by_recipe ? (
          <InspectView choice={choice} obstacle={obstacle} job={job} held={hold?.held ?? false} />
        ) : (
          <ScanView obstacle={obstacle} job={job} />
        ))}
      {known?.items.length === 0 && (
        <p class="card no-recipe">
          {words.no_recipe_yet} <a href={href("teach")}>{text.value.teach.title}</a>
          {" · "}
          <a href={href("help", "api")}>{text.value.help.api}</a>
        </p>
      )}
    </div>
  );
}

/** A job that is waiting for the station, or has just started. */
function waiting(open: readonly Job[], by_recipe: boolean): Job | undefined {
  return open.find(({ kind }) => kind === "scan" || (by_recipe && kind === "inspection"));
}
