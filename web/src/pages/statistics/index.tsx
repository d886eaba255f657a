/** Statistics of a characteristic: control chart, capability of the process, type-1 study of the station. */

import { data, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { useAutoReloaded } from "../../components/loading/auto_reloaded";
import { Show } from "../../components/loading/loading";
import { href, replaceQuery, route } from "../../state/browser/route";
import { text } from "../../text";
import { CapabilityCard } from "./capability_card";
import { ControlCard } from "./control_card";
import { Outcome } from "./outcome";
import { queryOf, referenceOf, type Selection, selectionOf, seriesQuery } from "./selection";
import { SelectionBar } from "./selection_bar";
import { gaugeRrQuery } from "./studies/plan";
import { Type1Card } from "./type_1_card";
import "./statistics.css";

export default function Statistics() {
  const { api } = useApp();
  const words = text.value.statistics;
  const { id = "" } = route.value;
  const recipe = useAutoReloaded(
    () => data(api.GET("/api/v1/recipes/{id}", { params: { path: { id } } })),
    ({ kind }) => kind.startsWith("recipe."),
    [id],
  );
  return (
    <div class="stack statistics">
      <p>
        <a href={href("inspections", undefined, { recipe: id })}>← {words.to_inspections}</a>
        {" · "}
        <a href={href("studies")}>{text.value.studies.fitness_link}</a>
      </p>
      {id === "" ? (
        <p class="card">{words.no_recipe}</p>
      ) : (
        <Show of={recipe.state}>{(recipe) => <OfRecipe key={id} recipe={recipe} />}</Show>
      )}
    </div>
  );
}

function OfRecipe({ recipe }: { recipe: Schemas["NewestRecipeDto"] }) {
  const { api } = useApp();
  const words = text.value.statistics;
  const selection = selectionOf(route.value.query);
  const change = (part: Partial<Selection>) =>
    replaceQuery("statistics", recipe.id, queryOf({ ...selectionOf(route.value.query), ...part }));
  const shown = selection.characteristic || (recipe.recipe.plan.characteristics[0]?.id ?? "");
  const path = { id: recipe.id, characteristic: shown };
  const query = seriesQuery(selection);
  const reference = referenceOf(selection);
  const inputs = [recipe.id, shown, JSON.stringify(query)];
  const finished = ({ kind }: { kind: string }) => kind === "inspection.finished";
  const chart = useAutoReloaded(
    () =>
      data(
        api.GET("/api/v1/recipes/{id}/characteristics/{characteristic}/control-chart", {
          params: { path, query },
        }),
      ),
    finished,
    inputs,
  );
  const type_1 = useAutoReloaded(
    async () => {
      if (reference === undefined || selection.serial === "") return undefined;
      const n_sigmas = selection.sigmas === "4" ? ("4" as const) : ("6" as const);
      const params = { path, query: { ...query, reference, n_sigmas } };
      return await data(api.GET("/api/v1/recipes/{id}/characteristics/{characteristic}/type-1-study", { params }));
    },
    finished,
    [...inputs, reference, selection.sigmas],
  );
  const unit = chart.state.value.value?.unit ?? "";
  return (
    <>
      <h1>{words.title(shown, recipe.recipe.name)}</h1>
      <SelectionBar recipe={recipe} selection={selection} shown={shown} change={change} />
      <Outcome of={chart.state}>
        {(chart) => (
          <>
            <ControlCard chart={chart} />
            <CapabilityCard chart={chart} />
          </>
        )}
      </Outcome>
      <div class="cards">
        <Type1Card selection={selection} unit={unit} change={change} study={type_1.state} />
        <section class="card stack" aria-label={words.gauge_rr}>
          <h2>{words.gauge_rr}</h2>
          <p class="muted">{words.gauge_rr_hint}</p>
          <p>
            <a class="button" href={href("studies", undefined, gaugeRrQuery(recipe.id, shown))}>
              {words.gauge_rr_plan}
            </a>
          </p>
        </section>
      </div>
    </>
  );
}
