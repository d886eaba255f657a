/** The list of inspections. */

import { VerdictWord } from "../../components/verdict";
import { href } from "../../state/browser/route";
import { type Inspection, versionName, worstFirst } from "../../state/records/inspections";
import { language, text } from "../../text";
import { dateTime } from "../../units";
import { withUnit } from "./values";

export function Rows({ items }: { items: readonly Inspection[] }) {
  const words = text.value.inspections;
  return (
    <section class="card" aria-label={words.title}>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.serial}</th>
            <th>{words.verdict}</th>
            <th>{words.worst}</th>
            <th>{words.recipe}</th>
            <th>{words.when}</th>
            <th>{words.order}</th>
          </tr>
        </thead>
        <tbody>
          {items.map((item) => (
            <Row key={item.id} item={item} />
          ))}
        </tbody>
      </table>
    </section>
  );
}

function Row({ item }: { item: Inspection }) {
  const words = text.value.inspections;
  const [worst] = worstFirst(item.results);
  return (
    <tr data-inspection={item.id} data-verdict={item.verdict}>
      <td>
        <a class="name" href={href("inspections", item.id)}>
          {item.serial}
        </a>
        {item.re_evaluated_from && <div class="muted">{words.re_evaluated}</div>}
        {item.simulated && (
          <div class="muted" title={words.simulated_hint}>
            {words.simulated}
          </div>
        )}
      </td>
      <td data-label={words.verdict}>
        <VerdictWord verdict={item.verdict} />
      </td>
      <td data-label={words.worst}>
        {worst ? (
          <>
            {worst.id} <span class="number nowrap">{withUnit(worst.value, worst)}</span>
          </>
        ) : (
          "–"
        )}
      </td>
      <td data-label={words.recipe}>
        <span class="mono">{versionName(item.recipe)}</span>
      </td>
      <td class="nowrap" data-label={words.when}>
        {dateTime(item.created_at_ms, language.value)}
      </td>
      <td data-label={words.order}>{item.order ?? "–"}</td>
    </tr>
  );
}
