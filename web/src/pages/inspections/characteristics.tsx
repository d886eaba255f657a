/** The measured characteristics of a part with their limits. */

import { useEffect, useRef } from "preact/hooks";
import { VerdictWord } from "../../components/verdict";
import { href } from "../../state/browser/route";
import { type CharacteristicResult, limitsOf, worstFirst } from "../../state/records/inspections";
import { text } from "../../text";
import { Remarks } from "./remarks";
import { measureName, uncertaintyOf, withUnit } from "./values";

interface Properties {
  /** Id of the recipe, for links to statistics. */
  recipe_id: string;
  results: readonly CharacteristicResult[];
  /** The characteristic highlighted on the cloud. */
  current?: string | undefined;
  /** Shows a characteristic on the cloud; undefined if it has no place there. */
  shower?: (id: string) => (() => void) | undefined;
}

export function Characteristics({ recipe_id, results, current, shower }: Properties) {
  const words = text.value.inspections;
  return (
    <section class="card" aria-label={words.table}>
      <h2>{words.table}</h2>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.characteristic}</th>
            <th class="number">{words.nominal}</th>
            <th class="number">{words.lower}</th>
            <th class="number">{words.upper}</th>
            <th class="number">{words.actual}</th>
            <th class="number" title={words.uncertainty_hint}>
              {words.uncertainty}
            </th>
            <th>{words.verdict}</th>
          </tr>
        </thead>
        <tbody>
          {worstFirst(results).map((result) => (
            <Row
              key={result.id}
              recipe_id={recipe_id}
              result={result}
              is_current={result.id === current}
              show={shower?.(result.id)}
            />
          ))}
        </tbody>
      </table>
    </section>
  );
}

interface RowProperties {
  recipe_id: string;
  result: CharacteristicResult;
  is_current: boolean;
  show: (() => void) | undefined;
}

function Row({ recipe_id, result, is_current, show }: RowProperties) {
  const row = useRef<HTMLTableRowElement>(null);
  const from_here = useRef(false);
  useEffect(() => {
    if (is_current && !from_here.current) row.current?.scrollIntoView({ block: "nearest" });
    from_here.current = false;
  }, [is_current]);
  const press = () => {
    // The cloud comes into view, so the row stays where it is.
    from_here.current = !is_current;
    show?.();
  };
  const words = text.value.inspections;
  const { lower, upper } = limitsOf(result);
  return (
    <tr
      ref={row}
      data-characteristic={result.id}
      data-verdict={result.verdict ?? undefined}
      aria-current={is_current ? "true" : undefined}
    >
      <td>
        <strong>{result.id}</strong> <span class="muted">{measureName(result)}</span>{" "}
        <a href={href("statistics", recipe_id, { characteristic: result.id })}>
          {text.value.statistics.of_characteristic}
          <span class="visually-hidden">: {result.id}</span>
        </a>{" "}
        {show && (
          <button type="button" aria-pressed={is_current} onClick={press}>
            {words.show_on_cloud}
            <span class="visually-hidden">: {result.id}</span>
          </button>
        )}
        <Remarks result={result} />
      </td>
      <td class="number nowrap" data-label={words.nominal}>
        {withUnit(result.nominal, result)}
      </td>
      <td class="number nowrap" data-label={words.lower}>
        {withUnit(lower, result)}
      </td>
      <td class="number nowrap" data-label={words.upper}>
        {withUnit(upper, result)}
      </td>
      <td class="number nowrap" data-label={words.actual}>
        {result.value == null ? words.not_measured : <strong>{withUnit(result.value, result)}</strong>}
      </td>
      <td class="number nowrap" data-label={words.uncertainty}>
        {uncertaintyOf(result)}
      </td>
      <td data-label={words.verdict}>
        <VerdictWord verdict={result.verdict ?? undefined} />
      </td>
    </tr>
  );
}
