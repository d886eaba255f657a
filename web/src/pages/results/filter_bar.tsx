/** The filter of the list; the name is applied on Enter or blur. */

import { useId } from "preact/hooks";
import { selected } from "../../components/fields/selected";
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
  const id = useId();
  const change = (part: Partial<ResultFilter>) =>
    replaceQuery("results", undefined, queryOf({ ...filterOf(route.value.query), ...part }));
  const any = Object.keys(queryOf(filter)).length > 0;
  return (
    <search class="card row end filter-bar">
      <div class="field">
        <label for={`${id}-name`}>{words.by_name}</label>
        <input
          id={`${id}-name`}
          type="search"
          value={filter.name}
          spellcheck={false}
          onChange={(event) => change({ name: event.currentTarget.value.trim() })}
        />
      </div>
      <div class="field">
        <label for={`${id}-state`}>{words.by_state}</label>
        <select
          id={`${id}-state`}
          value={filter.outcome}
          onChange={(event) => change({ outcome: selected(event, OUTCOMES) ?? "" })}
        >
          <option value="">{words.all}</option>
          {OUTCOMES.map((outcome) => (
            <option key={outcome} value={outcome}>
              {text.value.outcomes[outcome]}
            </option>
          ))}
        </select>
      </div>
      <div class="field">
        <label for={`${id}-from`}>{words.from_day}</label>
        <input
          id={`${id}-from`}
          type="date"
          value={filter.from_day}
          onChange={(event) => change({ from_day: event.currentTarget.value })}
        />
      </div>
      <div class="field">
        <label for={`${id}-to`}>{words.to_day}</label>
        <input
          id={`${id}-to`}
          type="date"
          value={filter.to_day}
          onChange={(event) => change({ to_day: event.currentTarget.value })}
        />
      </div>
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
