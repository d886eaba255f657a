/** The newest part, huge: its verdict, its value with uncertainty, and where that lies in the tolerance. */

import { useMemo } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { CommandButton } from "../../parts/command_button";
import { Command } from "../../state/command";
import { outcomeOf, SIGN, standing } from "../../state/outcome";
import { href } from "../../state/route";
import type { Measured, ScannedPart } from "../../state/scanned";
import { language, text } from "../../text";
import { decimal, length, moment } from "../../units";
import { measurementOf, type Recipe } from "./recipe";
import { ToleranceBar } from "./tolerance_bar";

interface Properties {
  part: ScannedPart | undefined;
  recipe: Recipe;
  /** A measurement of it is being taken by this page. */
  measuring: boolean;
}

export function LastResult({ part, recipe, measuring }: Properties) {
  const words = text.value.operate;
  if (!part) {
    return (
      <section class="card last-result empty" aria-label={words.last_result}>
        <h2>{words.last_result}</h2>
        <p class="muted">{words.no_result}</p>
      </section>
    );
  }
  const outcome = outcomeOf(part);
  const measured = standing(part);
  return (
    <section class="card last-result live-data" aria-label={words.last_result} data-outcome={outcome}>
      <div class="row">
        <h2 class="grow">{part.scan.name}</h2>
        <span class="muted">{moment(part.scan.created_at_ms, language.value)}</span>
      </div>
      {measuring && !measured ? (
        <p class="part-verdict measured" role="status">
          {words.measuring}
        </p>
      ) : (
        <p class={`part-verdict ${outcome}`} role="status">
          <span aria-hidden="true">{SIGN[outcome]}</span> {text.value.outcomes[outcome]}
        </p>
      )}
      {words.because[outcome] && <p>{words.because[outcome]}</p>}
      {measured && <Value measured={measured} />}
      {measured && <ToleranceBar measured={measured} />}
      <div class="row">
        <a class="button" href={href("result", part.scan.id)}>
          {words.open}
        </a>
        {!measured && !measuring && part.scan.state === "complete" && <MeasureNow part={part} recipe={recipe} />}
      </div>
    </section>
  );
}

function Value({ measured }: { measured: Measured }) {
  const words = text.value.operate;
  const { unit, expanded_uncertainty: u } = measured;
  const uncertainty = unit === "mm" ? length(u, language.value) : `${decimal(u, 3, language.value)} °`;
  return (
    <p class="value-line">
      <span class="muted">{text.value.measured_as[measured.tool] ?? measured.tool}</span>
      <span class="big number">
        {decimal(measured.value, 3, language.value)} {unit}
      </span>
      <span class="muted number" title={words.uncertainty_hint}>
        U = {uncertainty} (k = 2)
      </span>
    </p>
  );
}

/** For a part whose measurement was not taken: its scan was started elsewhere, or the page was closed. */
function MeasureNow({ part, recipe }: { part: ScannedPart; recipe: Recipe }) {
  const { api } = useApp();
  const body = measurementOf(recipe);
  const id = part.scan.id;
  const measure = useMemo(
    () =>
      new Command(async () => {
        if (!body) return;
        await data(api.POST("/api/v1/scans/{id}/measurements", { params: { path: { id } }, body }));
      }),
    [api, id, JSON.stringify(body)],
  );
  if (!body || !recipe.tool) return null;
  return (
    <CommandButton command={measure}>{text.value.operate.measure(text.value.tools[recipe.tool])}</CommandButton>
  );
}
