/** The results page: filter, trend and list of all scans. */

import { useEffect, useMemo } from "preact/hooks";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { DamagedRecords } from "../../components/dialogs/damaged";
import { ProblemCard } from "../../components/problem";
import { ResultViews } from "../../components/result_views";
import { href, route } from "../../state/browser/route";
import { text } from "../../text";
import { filterOf, queryOf, serverQuery } from "./filter";
import { FilterBar } from "./filter_bar";
import { ResultsState } from "./results_state";
import { Rows } from "./rows";
import { TrendCard } from "./trend";
import "./results.css";

export default function Results() {
  const { api, events } = useApp();
  const words = text.value.results;
  const filter = filterOf(route.value.query);
  const state = useMemo(() => new ResultsState(api, events, serverQuery(filter)), [api, events]);
  useEffect(() => state.follow(), [state]);
  useEffect(() => state.setQuery(serverQuery(filter)));
  const parts = state.parts.value;
  const problem = state.problem.value;
  const filtered = Object.keys(queryOf(filter)).length > 0;
  return (
    <div class="stack results">
      <div class="row">
        <h1 class="grow">{words.title}</h1>
        <ResultViews current="results" />
      </div>
      <FilterBar filter={filter} n_read={parts?.length} has_older={state.has_older.value} />
      {problem && <ProblemCard problem={problem} />}
      <DamagedRecords rows={state.damaged.value} />
      {!parts && !problem && <p class="muted">{text.value.frame.loading}</p>}
      {parts?.length === 0 && !filtered && (
        <section class="card">
          <h2>{words.none_yet}</h2>
          <p>{words.none_yet_how}</p>
          <a class="button" href={href("operate")}>
            {text.value.pages.operate}
          </a>
        </section>
      )}
      {parts?.length === 0 && filtered && <p class="card muted">{words.nothing_fits}</p>}
      {parts && parts.length > 0 && (
        <>
          <TrendCard parts={parts.filter(({ scan }) => scan.purpose === "production")} />
          <Rows parts={parts} />
        </>
      )}
      {state.has_older.value && <CommandButton command={state.older}>{words.older}</CommandButton>}
    </div>
  );
}
