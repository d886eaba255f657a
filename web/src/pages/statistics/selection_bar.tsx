/** Selects characteristic and inspections; text fields are applied on Enter or blur. */

import type { TargetedEvent } from "preact";
import { useId } from "preact/hooks";
import type { Schemas } from "../../api/client";
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
  const id = useId();
  const known = recipe.recipe.plan.characteristics.map((characteristic) => characteristic.id);
  const field = (name: keyof Selection) => ({
    id: `${id}-${name}`,
    value: selection[name],
    onChange: (event: TargetedEvent<HTMLInputElement | HTMLSelectElement>) =>
      change({ [name]: event.currentTarget.value.trim() }),
  });
  const label = (name: keyof Selection, label: string) => <label for={`${id}-${name}`}>{label}</label>;
  return (
    <search class="card row end">
      <div class="field">
        {label("characteristic", common.characteristic)}
        <select {...field("characteristic")} value={shown}>
          {(known.includes(shown) ? known : [shown, ...known]).map((one) => (
            <option key={one} value={one}>
              {one}
            </option>
          ))}
        </select>
      </div>
      <div class="field">
        {label("version", common.version)}
        <select {...field("version")}>
          <option value="">{words.all_versions}</option>
          {versionsOf(recipe).map((version) => (
            <option key={version} value={`${version}`}>
              {version}
            </option>
          ))}
        </select>
      </div>
      <div class="field">
        {label("serial", common.serial)}
        <input type="search" placeholder={common.serial_hint} spellcheck={false} {...field("serial")} />
      </div>
      <div class="field">
        {label("order", common.order)}
        <input type="search" placeholder={common.serial_hint} spellcheck={false} {...field("order")} />
      </div>
      <div class="field">
        {label("from", common.from_day)}
        <input type="date" {...field("from")} />
      </div>
      <div class="field">
        {label("to", common.to_day)}
        <input type="date" {...field("to")} />
      </div>
      <div class="field">
        {label("limit", words.at_most)}
        <select {...field("limit")} value={selection.limit || LIMITS[0]}>
          {LIMITS.map((limit) => (
            <option key={limit} value={limit}>
              {words.newest(Number(limit))}
            </option>
          ))}
        </select>
      </div>
    </search>
  );
}
