/** One study: verdict, what is still missing, figures, report. */

import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { useAutoReloaded } from "../../../components/loading/auto_reloaded";
import { Show } from "../../../components/loading/loading";
import { VerdictWord } from "../../../components/verdict";
import { goTo, href } from "../../../state/browser/route";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { AddPosition } from "./add_position";
import { GaugeRrFigures, Type1Figures } from "./msa_figures";
import type { Kind } from "./plan";
import { Positions, Quantities } from "./positions";

export type Study = Schemas["StudyDto"];

export function kindOf({ plan }: Study): Kind {
  if (plan.acceptance) return "acceptance";
  return plan.type_1 ? "type_1" : "gauge_rr";
}

export function StudyView({ id }: { id: string }) {
  const { api } = useApp();
  const words = text.value.studies;
  const { state, reload } = useAutoReloaded(
    () => data(api.GET("/api/v1/studies/{id}", { params: { path: { id } } })),
    ({ kind, subject }) => (kind === "study.changed" && subject === id) || kind === "inspection.finished",
    [api, id],
  );
  return (
    <div class="stack studies">
      <p>
        <a href={href("studies")}>← {words.to_list}</a>
      </p>
      {state.value.problem && <h1>{words.title}</h1>}
      <Show of={state}>{(study) => <Details study={study} reload={reload} />}</Show>
    </div>
  );
}

function Details({ study, reload }: { study: Study; reload: () => Promise<void> }) {
  const words = text.value.studies;
  const report = `/api/v1/studies/${study.id}/report`;
  return (
    <>
      <header class="row" data-verdict={study.verdict}>
        <div class="grow">
          <h1>{study.name}</h1>
          <span class="muted">
            {words.kinds[kindOf(study)]} · {dateTime(study.created_at_ms, language.value)} · {study.author}
          </span>
        </div>
        {study.positions.some(({ simulated }) => simulated) && (
          <span class="tag" title={words.simulated_hint}>
            {words.simulated}
          </span>
        )}
        <VerdictWord verdict={study.verdict ?? undefined} big />
      </header>
      <Missing study={study} />
      {study.plan.acceptance && <Quantities study={study} />}
      {study.plan.acceptance && <AddPosition study={study} reload={reload} />}
      {study.plan.acceptance && <Positions study={study} />}
      {study.reason && (
        <p class="card" lang="en">
          {study.reason}
        </p>
      )}
      {study.type_1 && <Type1Figures figures={study.type_1} />}
      {study.gauge_rr && <GaugeRrFigures figures={study.gauge_rr} />}
      <section class="card row" aria-label={words.report}>
        <h2 class="grow">{words.report}</h2>
        <a class="button" href={report} target="_blank" rel="noreferrer">
          {words.report_html}
        </a>
        <a class="button" href={`${report}?format=pdf`} target="_blank" rel="noreferrer">
          {words.report_pdf}
        </a>
        <Delete study={study} />
      </section>
    </>
  );
}

function Missing({ study }: { study: Study }) {
  const words = text.value.studies;
  const { missing_positions: positions, missing_inspections: inspections } = study;
  const complete = positions.length === 0 && inspections.length === 0;
  return (
    <section class="card stack" aria-label={words.missing} data-complete={complete}>
      {complete ? (
        <p>{words.complete}</p>
      ) : (
        <>
          <h2>{words.missing}</h2>
          <ul>
            {positions.map(({ procedure, n_present, n_needed }) => (
              <li key={procedure}>
                {words.procedures[procedure]}: {words.missing_positions(n_present, n_needed)}
              </li>
            ))}
            {inspections.map(({ serial, operator, n_present, n_needed }) => (
              <li key={`${serial}/${operator}`}>
                {words.of_part(serial, operator ?? undefined)}: {words.missing_inspections(n_present, n_needed)}
              </li>
            ))}
          </ul>
          {inspections.length > 0 && <p class="muted">{words.inspect_how}</p>}
        </>
      )}
    </section>
  );
}

function Delete({ study }: { study: Study }) {
  const { api } = useApp();
  const words = text.value.studies;
  const remove = useMemo(
    () =>
      new Command(async () => {
        await data(api.DELETE("/api/v1/studies/{id}", { params: { path: { id: study.id } } }));
        goTo("studies");
      }),
    [api, study.id],
  );
  return (
    <span title={words.delete_hint}>
      <CommandButton command={remove} kind="quiet">
        {words.delete_study}
      </CommandButton>
    </span>
  );
}
