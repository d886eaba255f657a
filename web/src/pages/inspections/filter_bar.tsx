/** The filter of the list; text fields are applied on Enter or blur. */

import { Choice } from "../../components/fields/choice";
import { FilterField } from "../../components/fields/filter_field";
import { replaceQuery, route } from "../../state/browser/route";
import { OUTCOME_SYMBOL, VERDICTS } from "../../state/records/outcome";
import { text } from "../../text";
import { exportHref, filterOf, type InspectionFilter, queryOf } from "./filter";

interface Properties {
  filter: InspectionFilter;
  n_read: number | undefined;
  has_older: boolean;
}

export function FilterBar({ filter, n_read, has_older }: Properties) {
  const words = text.value.inspections;
  const change = (part: Partial<InspectionFilter>) =>
    replaceQuery("inspections", undefined, queryOf({ ...filterOf(route.value.query), ...part }));
  const field = (name: keyof InspectionFilter) => ({
    value: filter[name],
    onChange: (value: string) => change({ [name]: value }),
  });
  return (
    <search class="card row end filter-bar">
      <FilterField label={words.serial} placeholder={words.serial_hint} {...field("serial")} />
      <FilterField label={words.recipe} placeholder={words.recipe_hint} {...field("recipe")} />
      <Choice
        label={words.verdict}
        {...field("verdict")}
        options={[
          ["", words.any],
          ...VERDICTS.map((one) => [one, `${OUTCOME_SYMBOL[one]} ${text.value.outcomes[one]}`] as const),
        ]}
      />
      <FilterField label={words.from_day} type="date" {...field("from")} />
      <FilterField label={words.to_day} type="date" {...field("to")} />
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
