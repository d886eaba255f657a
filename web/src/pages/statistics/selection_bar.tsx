/** Selects characteristic and inspections; text fields are applied on Enter or blur. */

import type { Schemas } from "../../api/client";
import { Choice } from "../../components/fields/choice";
import { FilterField } from "../../components/fields/filter_field";
import { text } from "../../text";
import { versionsOf } from "../operate/inspect/choice";
import { LIMITS, type Selection } from "./selection";

interface Properties {
  recipe: Schemas["NewestRecipeDto"];
  selection: Selection;
  /** The characteristic shown. */
  shown: string;
  change: (part: Partial<Selection>) => void;
}

export function SelectionBar({ recipe, selection, shown, change }: Properties) {
  const words = text.value.statistics;
  const common = text.value.inspections;
  const known = recipe.recipe.plan.characteristics.map((characteristic) => characteristic.id);
  const field = (name: keyof Selection) => ({
    value: selection[name],
    onChange: (value: string) => change({ [name]: value }),
  });
  return (
    <search class="card row end">
      <Choice
        label={common.characteristic}
        {...field("characteristic")}
        value={shown}
        options={(known.includes(shown) ? known : [shown, ...known]).map((one) => [one, one])}
      />
      <Choice
        label={common.version}
        {...field("version")}
        options={[["", words.all_versions], ...versionsOf(recipe).map((one) => [`${one}`, `${one}`] as const)]}
      />
      <FilterField label={common.serial} placeholder={common.serial_hint} {...field("serial")} />
      <FilterField label={common.order} placeholder={common.serial_hint} {...field("order")} />
      <FilterField label={common.from_day} type="date" {...field("from")} />
      <FilterField label={common.to_day} type="date" {...field("to")} />
      <Choice
        label={words.at_most}
        {...field("limit")}
        value={selection.limit || LIMITS[0]}
        options={LIMITS.map((limit) => [limit, words.newest(Number(limit))])}
      />
    </search>
  );
}
