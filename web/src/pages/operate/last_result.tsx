/** The newest part in large type: verdict, deciding characteristic with uncertainty, tolerance bar. */

import { href } from "../../state/browser/route";
import { decidingCharacteristic, OUTCOME_SYMBOL, outcomeOf } from "../../state/records/outcome";
import type { Measured, ScannedPart } from "../../state/records/scanned";
import { language, text } from "../../text";
import { dateTime, decimal, length } from "../../units";
import type { Last } from "./last_part";
import { ToleranceBar } from "./tolerance_bar";

export function LastResult({ last }: { last: Last }) {
  const words = text.value.operate;
  if (last.kind === "part") return <Part part={last.part} />;
  const reasons = { none: words.no_result, running: words.scan_running, without_part: words.without_part };
  return (
    <section class="card last-result empty" aria-label={words.last_result} data-outcome={last.kind}>
      <h2>{(last.kind === "running" && last.name) || words.last_result}</h2>
      <p class="muted">{reasons[last.kind]}</p>
    </section>
  );
}

function Part({ part }: { part: ScannedPart }) {
  const words = text.value.operate;
  const outcome = outcomeOf(part);
  const measured = decidingCharacteristic(part);
  return (
    <section class="card last-result live-data" aria-label={words.last_result} data-outcome={outcome}>
      <div class="row">
        <h2 class="grow">{part.scan.name}</h2>
        <span class="muted">{dateTime(part.scan.created_at_ms, language.value)}</span>
      </div>
      <p class={`part-verdict ${outcome}`} role="status">
        <span aria-hidden="true">{OUTCOME_SYMBOL[outcome]}</span> {text.value.outcomes[outcome]}
      </p>
      {words.because[outcome] && <p>{words.because[outcome]}</p>}
      {measured?.value !== undefined && <Value measured={measured} value={measured.value} />}
      {measured?.value !== undefined && <Bar measured={measured} value={measured.value} />}
      {part.measured.length > 1 && <Others part={part} shown={measured} />}
      <div class="row">
        <a class="button" href={href("result", part.scan.id)}>
          {words.open}
        </a>
      </div>
    </section>
  );
}

function Bar({ measured, value }: { measured: Measured; value: number }) {
  const { nominal, tolerance, expanded_uncertainty: u = 0, unit, verdict } = measured;
  if (nominal === undefined || tolerance === undefined) return null;
  const limited = { nominal, lower: nominal - tolerance, upper: nominal + tolerance, value, u };
  return <ToleranceBar limited={limited} unit={unit} verdict={verdict} />;
}

/** Display name of a characteristic. */
export function characteristicName({ tool, name }: Measured): string {
  const what = text.value.measured_as[tool] ?? tool;
  return name === undefined ? what : `${what} “${name}”`;
}

function Value({ measured, value }: { measured: Measured; value: number }) {
  const { unit, expanded_uncertainty: u } = measured;
  const uncertainty = unit === "mm" ? length(u, language.value) : `${decimal(u, 3, language.value)} °`;
  return (
    <p class="value-line">
      <span class="muted">{characteristicName(measured)}</span>
      <span class="big number">
        {decimal(value, 3, language.value)} {unit}
      </span>
      <span class="muted number" title={text.value.operate.uncertainty_hint}>
        U = {uncertainty} (k = 2)
      </span>
    </p>
  );
}

/** The other characteristics, one per line. */
function Others({ part, shown }: { part: ScannedPart; shown: Measured | undefined }) {
  return (
    <ul class="characteristics">
      {part.measured
        .filter((one) => one !== shown)
        .map((one) => (
          <li key={one.id} data-verdict={one.verdict}>
            {one.verdict && <span aria-hidden="true">{OUTCOME_SYMBOL[one.verdict]} </span>}
            {characteristicName(one)}{" "}
            <span class="number">
              {one.value === undefined ? "–" : `${decimal(one.value, 3, language.value)} ${one.unit}`}
            </span>{" "}
            {one.verdict && text.value.outcomes[one.verdict]}
          </li>
        ))}
    </ul>
  );
}
