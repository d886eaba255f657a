/** The inspections page: a list filtered by the server, or one inspection. */

import { useEffect, useMemo } from "preact/hooks";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { DamagedRecords } from "../../components/dialogs/damaged";
import { ProblemCard } from "../../components/problem";
import { ResultViews } from "../../components/result_views";
import { route } from "../../state/browser/route";
import { type Inspection, type InspectionsQuery, readInspections } from "../../state/records/inspections";
import { PagedRecords } from "../../state/records/paged";
import { text } from "../../text";
import { filterOf, queryOf, serverQuery } from "./filter";
import { FilterBar } from "./filter_bar";
import { InspectionView } from "./inspection";
import { Rows } from "./rows";
import "./inspections.css";

export default function Inspections() {
  const { id } = route.value;
  return id === undefined ? <List /> : <InspectionView key={id} id={id} />;
}

function List() {
  const { api, events } = useApp();
  const words = text.value.inspections;
  const filter = filterOf(route.value.query);
  const state = useMemo(
    () =>
      new PagedRecords<Inspection, InspectionsQuery>(
        {
          read: (limit, query, before) => readInspections(api, limit, query, before),
          concerns: ({ kind }) => kind === "inspection.finished" || kind === "scan.deleted",
        },
        events,
        serverQuery(filter),
      ),
    [api, events],
  );
  useEffect(() => state.follow(), [state]);
  useEffect(() => state.setQuery(serverQuery(filter)));
  const items = state.items.value;
  const problem = state.problem.value;
  const filtered = Object.keys(queryOf(filter)).length > 0;
  return (
    <div class="stack inspections">
      <div class="row">
        <h1 class="grow">{words.title}</h1>
        <ResultViews current="inspections" />
      </div>
      <FilterBar filter={filter} n_read={items?.length} has_older={state.has_older.value} />
      {problem && <ProblemCard problem={problem} />}
      <DamagedRecords rows={state.damaged.value} />
      {!items && !problem && <p class="muted">{text.value.frame.loading}</p>}
      {items?.length === 0 && !filtered && (
        <section class="card">
          <h2>{words.none_yet}</h2>
          <p>{words.none_yet_how}</p>
        </section>
      )}
      {items?.length === 0 && filtered && <p class="card muted">{words.nothing_fits}</p>}
      {items && items.length > 0 && <Rows items={items} />}
      {state.has_older.value && <CommandButton command={state.older}>{words.older}</CommandButton>}
    </div>
  );
}
