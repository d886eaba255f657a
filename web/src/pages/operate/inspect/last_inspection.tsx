/** The newest part in large type: verdict in words and colour, and its worst characteristics as tolerance bars. */

import { light_tower } from "../../../state/browser/light_tower";
import { href } from "../../../state/browser/route";
import {
  type CharacteristicResult,
  type Inspection,
  limitsOf,
  versionName,
  worstFirst,
} from "../../../state/records/inspections";
import { OUTCOME_SYMBOL } from "../../../state/records/outcome";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { measureName, uncertaintyOf, withUnit } from "../../inspections/values";
import { ToleranceBar } from "../tolerance_bar";
import type { Last } from "./last";

/** Characteristics shown with a bar. */
const N_WORST = 3;

/** `last`: undefined while it is being read. */
export function LastInspection({ last }: { last: Last | undefined }) {
  const words = text.value.operate;
  if (last?.kind === "inspection") return <Newest inspection={last.inspection} />;
  const reasons = {
    none: words.no_inspection,
    waiting: words.inspection_waiting,
    running: words.inspection_running,
    without_verdict: words.without_verdict,
  };
  const serial = last?.kind === "none" ? undefined : last?.serial;
  return (
    <section
      class="card last-result empty"
      aria-label={words.last_result}
      data-outcome={last ? last.kind : "loading"}
    >
      <h2>{serial ?? words.last_result}</h2>
      <p class="muted">{last ? reasons[last.kind] : text.value.frame.loading}</p>
    </section>
  );
}

function Newest({ inspection }: { inspection: Inspection }) {
  const words = text.value.operate;
  const { verdict, results } = inspection;
  const because = text.value.inspections.because[verdict];
  const worst = worstFirst(results).slice(0, N_WORST);
  const n_more = results.length - worst.length;
  return (
    <section class="card last-result live-data" aria-label={words.last_result} data-outcome={verdict}>
      <div class="row">
        <h2 class="grow">{inspection.serial}</h2>
        {inspection.simulated && (
          <span class="tag" title={text.value.inspections.simulated_hint}>
            {text.value.inspections.simulated}
          </span>
        )}
        <span class="muted">
          <span class="mono">{versionName(inspection.recipe)}</span> ·{" "}
          {dateTime(inspection.created_at_ms, language.value)}
        </span>
      </div>
      <p class={`part-verdict ${verdict} ${light_tower.value ? "light-tower" : ""}`} role="status">
        <span aria-hidden="true">{OUTCOME_SYMBOL[verdict]}</span> {text.value.outcomes[verdict]}
      </p>
      {because && <p>{because}</p>}
      {worst.map((result) => (
        <Characteristic key={result.id} result={result} />
      ))}
      <div class="row">
        <a class="button" href={href("inspections", inspection.id)}>
          {n_more > 0 ? words.open_with_more(n_more) : words.open_inspection}
        </a>
      </div>
    </section>
  );
}

function Characteristic({ result }: { result: CharacteristicResult }) {
  const { value, verdict, nominal } = result;
  const reason = verdict === "ok" ? undefined : (result.reason ?? result.failure);
  return (
    <div class="worst-characteristic" data-characteristic={result.id} data-verdict={verdict ?? undefined}>
      <p class="value-line">
        <span>
          {verdict && <span aria-hidden="true">{OUTCOME_SYMBOL[verdict]} </span>}
          <strong>{result.id}</strong> <span class="muted">{measureName(result)}</span>
        </span>
        <span class="big number">
          {value == null ? text.value.inspections.not_measured : withUnit(value, result)}
        </span>
        {value != null && (
          <span class="muted number" title={text.value.operate.uncertainty_hint}>
            U = {uncertaintyOf(result)} (k = {result.coverage_factor.toLocaleString(language.value)})
          </span>
        )}
        <span>{verdict && text.value.outcomes[verdict]}</span>
      </p>
      {value != null && (
        <ToleranceBar
          limited={{
            nominal: nominal ?? undefined,
            ...limitsOf(result),
            value,
            u: result.expanded_uncertainty ?? 0,
          }}
          unit={result.unit}
          verdict={verdict ?? undefined}
        />
      )}
      {reason && (
        <p class="muted" lang="en">
          {reason}
        </p>
      )}
    </div>
  );
}
