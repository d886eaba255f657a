/** The attributes of the recipe: names and values that are passed on with its results. */

import { useId, useLayoutEffect, useRef } from "preact/hooks";
import { text } from "../../../text";
import { type AttributeRow, LONGEST_NAME, LONGEST_VALUE, MAX_ATTRIBUTES, rowFault } from "./attributes";
import type { RecipeSettings } from "./recipe_settings";

export function AttributesFields({ settings }: { settings: RecipeSettings }) {
  const words = text.value.recipe_settings;
  const rows = settings.attributes.value;
  const add = useRef<HTMLButtonElement>(null);
  const added = useRef<number | undefined>(undefined);
  const full = rows.length >= MAX_ATTRIBUTES ? words.attributes_full(MAX_ATTRIBUTES) : undefined;
  return (
    <fieldset class="stack">
      <legend>{words.attributes}</legend>
      <p class="muted">{words.attributes_hint}</p>
      {rows.length > 0 && (
        <table class="attributes">
          <thead>
            <tr>
              <th>{words.attribute_name}</th>
              <th>{words.attribute_value}</th>
              <th>
                <span class="visually-hidden">{text.value.teach.remove}</span>
              </th>
            </tr>
          </thead>
          <tbody>
            {rows.map((one, idx) => (
              <Row
                key={one.row}
                settings={settings}
                one={one}
                number={idx + 1}
                focus={one.row === added.current}
                onRemoved={() => add.current?.focus()}
              />
            ))}
          </tbody>
        </table>
      )}
      <span class="command">
        <button
          ref={add}
          type="button"
          aria-disabled={full ? "true" : undefined}
          title={full}
          onClick={() => {
            if (!full) added.current = settings.addAttribute();
          }}
        >
          {words.add_attribute}
        </button>
        {full && <small class="why">{full}</small>}
      </span>
    </fieldset>
  );
}

interface RowProperties {
  settings: RecipeSettings;
  one: AttributeRow;
  number: number;
  /** Whether it takes the focus: it was just added. */
  focus: boolean;
  onRemoved: () => void;
}

function Row({ settings, one: { row, name, value }, number, focus, onRemoved }: RowProperties) {
  const words = text.value.recipe_settings;
  const id = useId();
  const input = useRef<HTMLInputElement>(null);
  useLayoutEffect(() => {
    if (focus) input.current?.focus();
  }, []);
  const fault = rowFault(settings.attributes.value, { row, name, value });
  return (
    <tr>
      <td>
        <input
          ref={input}
          value={name}
          aria-label={words.name_of(number)}
          maxLength={LONGEST_NAME}
          spellcheck={false}
          autoComplete="off"
          aria-invalid={fault ? "true" : undefined}
          aria-describedby={fault ? id : undefined}
          onInput={(event) => settings.changeAttribute(row, { name: event.currentTarget.value })}
        />
        {fault && (
          <div class="wrong" id={id}>
            {words.faults[fault]}
          </div>
        )}
      </td>
      <td>
        <input
          value={value}
          aria-label={words.value_of(number)}
          maxLength={LONGEST_VALUE}
          autoComplete="off"
          onInput={(event) => settings.changeAttribute(row, { value: event.currentTarget.value })}
        />
      </td>
      <td>
        <button
          type="button"
          aria-label={words.remove_attribute(name || String(number))}
          onClick={() => {
            settings.removeAttribute(row);
            onRemoved();
          }}
        >
          {text.value.teach.remove}
        </button>
      </td>
    </tr>
  );
}
