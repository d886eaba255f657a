/** The results page: filter, trend and list of all scans. */

import { useEffect, useMemo } from "preact/hooks";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { DamagedRecords } from "../../components/dialogs/damaged";
import { ProblemCard } from "../../components/problem";
import { ResultViews } from "../../components/result_views";
import { href, route } from "../../state/browser/route";
import { text } from "../../text";
import { filtered, filterOf, serverQuery } from "./filter";
import { FilterBar } from "./filter_bar";
import { ResultsState } from "./results_state";
import { Rows } from "./rows";
import { TrendCard } from "./trend";
import "./results.css";

export default function Results() {
  const { api, events } = useApp();
  const words = text.value.results;
  const state = useMemo(() => new ResultsState(api, events), [api, events]);
  useEffect(() => state.follow(), [state]);
  const { query } = route.value;
  const filter = useMemo(() => filterOf(query), [query]);
  const outcome = filter.outcome;
  useEffect(() => state.setQuery(serverQuery(outcome)), [state, outcome]);
  const parts = state.parts.value;
  const problem = state.problem.value;
  const shown = useMemo(() => (parts ? filtered(parts, filter) : []), [parts, filter]);
  return (
    <div class="stack results">
      <div class="row">
        <h1 class="grow">{words.title}</h1>
        <ResultViews current="results" />
      </div>
      {problem && <ProblemCard problem={problem} />}
      <DamagedRecords rows={state.damaged.value} />
      {!parts && !problem && <p class="muted">{text.value.frame.loading}</p>}
      {parts && parts.length === 0 && outcome === "" && (
        <section class="card">
          <h2>{words.none_yet}</h2>
          <p>{words.none_yet_how}</p>
          <a class="button" href={href("operate")}>
            {text.value.pages.operate}
          </a>
        </section>
      )}
      {parts && (parts.length > 0 || outcome !== "") && (
        <>
          <FilterBar
            filter={filter}
            n_shown={shown.length}
            n_read={parts.length}
            complete={!state.has_older.value}
          />
          <TrendCard parts={shown.filter(({ scan }) => scan.purpose === "production")} />
          <Rows parts={shown} />
          {state.has_older.value && <CommandButton command={state.older}>{words.older}</CommandButton>}
        </>
      )}
    </div>
  );
}
