/** The filter of the list; the name is applied on Enter or blur. */

import { Choice } from "../../components/fields/choice";
import { FilterField } from "../../components/fields/filter_field";
import { replaceQuery, route } from "../../state/browser/route";
import { OUTCOMES } from "../../state/records/outcome";
import { text } from "../../text";
import { filterOf, queryOf, type ResultFilter } from "./filter";

interface Properties {
  filter: ResultFilter;
  /** Undefined while the list is loading. */
  n_read: number | undefined;
  has_older: boolean;
}

export function FilterBar({ filter, n_read, has_older }: Properties) {
  const words = text.value.results;
  const change = (part: Partial<ResultFilter>) =>
    replaceQuery("results", undefined, queryOf({ ...filterOf(route.value.query), ...part }));
  const any = Object.keys(queryOf(filter)).length > 0;
  return (
    <search class="card row end filter-bar">
      <FilterField label={words.by_name} value={filter.name} onChange={(name) => change({ name })} />
      <Choice
        label={words.by_state}
        value={filter.outcome}
        options={(["", ...OUTCOMES] as const).map((one) => [one, one ? text.value.outcomes[one] : words.all])}
        onChange={(outcome) => change({ outcome })}
      />
      <FilterField
        label={words.from_day}
        type="date"
        value={filter.from_day}
        onChange={(from_day) => change({ from_day })}
      />
      <FilterField
        label={words.to_day}
        type="date"
        value={filter.to_day}
        onChange={(to_day) => change({ to_day })}
      />
      {any && (
        <button type="button" onClick={() => replaceQuery("results", undefined, {})}>
          {words.no_filter}
        </button>
      )}
      <span class="muted count" role="status">
        {n_read !== undefined && (has_older ? words.read_so_far(n_read) : words.read(n_read))}
      </span>
    </search>
  );
}
