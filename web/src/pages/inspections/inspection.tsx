/** One inspection: verdict, characteristics, provenance, and re-evaluation with another version. */

import { data } from "../../api/client";
import { useApp } from "../../app";
import { Show, useLoaded } from "../../components/loading/loading";
import { VerdictWord } from "../../components/verdict";
import { href } from "../../state/browser/route";
import { type Inspection, versionName } from "../../state/records/inspections";
import { language, text } from "../../text";
import { dateTime } from "../../units";
import { Characteristics } from "./characteristics";
import { Comparisons } from "./comparison";
import { dataFiles } from "./files";
import { PartCard } from "./part_card";
import { PartState } from "./part_state";
import { ReEvaluate } from "./re_evaluate";
import { ViolatedRules } from "./violated_rules";

export function InspectionView({ id }: { id: string }) {
  const { api } = useApp();
  const words = text.value.inspections;
  const { state } = useLoaded(
    () => data(api.GET("/api/v1/inspections/{id}", { params: { path: { id } } })),
    [api, id],
  );
  return (
    <div class="stack inspections">
      <p>
        <a href={href("inspections")}>← {words.to_list}</a>
      </p>
      {state.value.problem && <h1>{words.one}</h1>}
      <Show of={state}>{(inspection) => <InspectionDetails inspection={inspection} />}</Show>
    </div>
  );
}

function InspectionDetails({ inspection }: { inspection: Inspection }) {
  const words = text.value.inspections;
  const because = words.because[inspection.verdict];
  return (
    <>
      <header class="row" data-verdict={inspection.verdict}>
        <div class="grow">
          <h1>{inspection.serial}</h1>
          <span class="muted">
            {words.one} · {dateTime(inspection.created_at_ms, language.value)}
          </span>
        </div>
        {inspection.simulated && (
          <span class="tag" title={words.simulated_hint}>
            {words.simulated}
          </span>
        )}
        <VerdictWord verdict={inspection.verdict} big />
      </header>
      {because && <p>{because}</p>}
      {inspection.alignment_failure && (
        <p class="note">
          {words.no_datum}: <span lang="en">{inspection.alignment_failure}</span>
        </p>
      )}
      {inspection.violated_rules.length > 0 && <ViolatedRules inspection={inspection} />}
      {inspection.re_evaluated_from && <ChangedVerdicts inspection={inspection} />}
      {inspection.scan_id ? (
        <OnPart inspection={inspection} scan_id={inspection.scan_id} />
      ) : (
        <>
          <Characteristics recipe_id={inspection.recipe.id} results={inspection.results} />
          <Comparisons results={inspection.results} surface={undefined} />
        </>
      )}
      <div class="cards">
        <Facts inspection={inspection} />
        <Reports inspection={inspection} />
        <ReEvaluate inspection={inspection} />
      </div>
    </>
  );
}

/** The characteristics with the cloud of the part. */
function OnPart({ inspection, scan_id }: { inspection: Inspection; scan_id: string }) {
  const app = useApp();
  const { api } = app;
  const { state } = useLoaded(async () => {
    const { id, version } = inspection.recipe;
    const [scan, { recipe }] = await Promise.all([
      data(api.GET("/api/v1/scans/{id}", { params: { path: { id: scan_id } } })),
      data(api.GET("/api/v1/recipes/{id}/versions/{version}", { params: { path: { id, version } } })),
    ]);
    return new PartState(app, inspection, recipe.plan, scan);
  }, [api, inspection, scan_id]);
  const part = state.value.value;
  return (
    <>
      <Characteristics
        recipe_id={inspection.recipe.id}
        results={inspection.results}
        current={part?.current.value}
        shower={(id) => (part?.canShow(id) ? () => part.showFromRow(id) : undefined)}
      />
      <Show of={state}>{(part) => <PartCard state={part} />}</Show>
      <Comparisons
        results={inspection.results}
        surface={part?.surface}
        reveal={() => part?.result.view.reveal()}
      />
    </>
  );
}

function Facts({ inspection }: { inspection: Inspection }) {
  const words = text.value.inspections;
  const { recipe, attributes } = inspection;
  return (
    <section class="card stack" aria-label={words.facts}>
      <h2>{words.facts}</h2>
      <dl class="facts">
        <dt>{words.recipe}</dt>
        <dd>
          <span class="mono">{versionName(recipe)}</span>
        </dd>
        <dt>{words.calibration}</dt>
        <dd>
          <a class="mono" href={href("calibration", undefined, { show: inspection.calibration_id })}>
            {inspection.calibration_id.slice(0, 8)}
          </a>
        </dd>
        <dt>{words.devices}</dt>
        <dd>{inspection.simulated ? words.simulated_hint : words.real}</dd>
        <dt>{words.order}</dt>
        <dd>{inspection.order ?? "–"}</dd>
        <dt>{words.seq}</dt>
        <dd>{inspection.seq}</dd>
        {Object.entries(attributes).map(([name, value]) => [
          <dt key={name}>{name}</dt>,
          <dd key={`${name}=`}>{value}</dd>,
        ])}
        <dt>{words.result}</dt>
        <dd>
          {inspection.scan_id ? (
            <>
              <a href={href("result", inspection.scan_id)}>{words.open_scan}</a>
              {" · "}
              <a href={href("teach", inspection.scan_id, { inspection: inspection.id })}>{words.teach}</a>
            </>
          ) : (
            words.scan_deleted
          )}
        </dd>
      </dl>
    </section>
  );
}

/** The inspection as a document, and its data as files. */
function Reports({ inspection }: { inspection: Inspection }) {
  const words = text.value.inspections;
  const report = `/api/v1/inspections/${inspection.id}/report`;
  const { dfq, csv, json } = dataFiles(inspection);
  return (
    <section class="card stack" aria-label={words.report}>
      <h2>{words.report}</h2>
      <div class="row">
        <a class="button" href={report} target="_blank" rel="noreferrer">
          {words.report_html}
        </a>
        <a class="button" href={`${report}?format=pdf`} target="_blank" rel="noreferrer">
          {words.report_pdf}
        </a>
        <a class="button" {...dfq}>
          {words.report_dfq}
        </a>
        <a class="button" {...csv} title={words.data_csv_hint}>
          {words.data_csv}
        </a>
        <a class="button" {...json} title={words.data_json_hint}>
          {words.data_json}
        </a>
      </div>
    </section>
  );
}

/** Verdicts that differ from those of the earlier inspection. */
function ChangedVerdicts({ inspection }: { inspection: Inspection }) {
  const words = text.value.inspections;
  const { changed, re_evaluated_from } = inspection;
  return (
    <section class="card stack" aria-label={words.changed}>
      <h2>{words.changed}</h2>
      <p>
        {words.before}{" "}
        <a href={href("inspections", re_evaluated_from ?? undefined)}>
          {words.earlier} {inspection.serial}
        </a>
      </p>
      {changed.length === 0 ? (
        <p class="muted">{words.changed_none}</p>
      ) : (
        <table>
          <thead>
            <tr>
              <th>{words.characteristic}</th>
              <th>{words.was}</th>
              <th>{words.now}</th>
            </tr>
          </thead>
          <tbody>
            {changed.map(({ id, before, after }) => (
              <tr key={id} data-changed={id}>
                <th scope="row">{id}</th>
                <td>{before ? <VerdictWord verdict={before} /> : words.not_evaluated}</td>
                <td>{after ? <VerdictWord verdict={after} /> : words.not_evaluated}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}
