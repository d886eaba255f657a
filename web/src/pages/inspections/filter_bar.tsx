/** The filter of the list; text fields are applied on Enter or blur. */

import type { ComponentChildren, TargetedEvent } from "preact";
import { useId } from "preact/hooks";
import { replaceQuery, route } from "../../state/browser/route";
import { OUTCOME_SYMBOL, VERDICTS } from "../../state/records/outcome";
import { text } from "../../text";
import { exportHref, filterOf, type InspectionFilter, queryOf } from "./filter";

/** Properties common to the fields. */
interface Typed {
  id: string;
  value: string;
  onChange: (event: TargetedEvent<HTMLInputElement>) => void;
}

interface Properties {
  filter: InspectionFilter;
  n_read: number | undefined;
  has_older: boolean;
}

export function FilterBar({ filter, n_read, has_older }: Properties) {
  const words = text.value.inspections;
  const id = useId();
  const change = (part: Partial<InspectionFilter>) =>
    replaceQuery("inspections", undefined, queryOf({ ...filterOf(route.value.query), ...part }));
  const typed = (name: keyof InspectionFilter, label: string, field: (properties: Typed) => ComponentChildren) => (
    <div class="field">
      <label for={`${id}-${name}`}>{label}</label>
      {field({
        id: `${id}-${name}`,
        value: filter[name],
        onChange: (event) => change({ [name]: event.currentTarget.value.trim() }),
      })}
    </div>
  );
  return (
    <search class="card row end filter-bar">
      {typed("serial", words.serial, (field) => (
        <input type="search" placeholder={words.serial_hint} spellcheck={false} {...field} />
      ))}
      {typed("recipe", words.recipe, (field) => (
        <input type="search" placeholder={words.recipe_hint} spellcheck={false} {...field} />
      ))}
      <div class="field">
        <label for={`${id}-verdict`}>{words.verdict}</label>
        <select
          id={`${id}-verdict`}
          value={filter.verdict}
          onChange={(event) => change({ verdict: event.currentTarget.value })}
        >
          <option value="">{words.any}</option>
          {VERDICTS.map((verdict) => (
            <option key={verdict} value={verdict}>
              {OUTCOME_SYMBOL[verdict]} {text.value.outcomes[verdict]}
            </option>
          ))}
        </select>
      </div>
      {typed("from", words.from_day, (field) => (
        <input type="date" {...field} />
      ))}
      {typed("to", words.to_day, (field) => (
        <input type="date" {...field} />
      ))}
      {Object.keys(queryOf(filter)).length > 0 && (
        <button type="button" onClick={() => replaceQuery("inspections", undefined, {})}>
          {words.no_filter}
        </button>
      )}
      <a class="button" href={exportHref(filter, "csv")} download="inspections.csv" title={words.export_hint}>
        {words.export}
      </a>
      <a class="button" href={exportHref(filter, "dfq")} download="inspections.dfq" title={words.export_dfq_hint}>
        {words.export_dfq}
      </a>
      <span class="muted count" role="status">
        {n_read !== undefined && (has_older ? words.read_so_far(n_read) : words.read(n_read))}
      </span>
    </search>
  );
}
