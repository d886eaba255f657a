/** The fold-out: what is scanned and measured. */

import { useId } from "preact/hooks";
import type { Form } from "../../parts/form";
import { NumberField } from "../../parts/number_field";
import { language, text } from "../../text";
import { decimal } from "../../units";
import { type Recipe, TOOLS, type Tool } from "./recipe";

interface Properties {
  recipe: Recipe;
  form: Form;
  onChange: (recipe: Recipe) => void;
  /** Where the stage can go, mm. */
  travel_mm: readonly number[];
}

export function SetUp({ recipe, form, onChange, travel_mm }: Properties) {
  const words = text.value.operate;
  const id = useId();
  const [lowest = -1e4, highest = 1e4] = travel_mm;
  const unit = recipe.tool === "angle" ? "°" : "mm";
  const change = (part: Partial<Recipe>) => onChange({ ...recipe, ...part });
  return (
    <details class="card set-up">
      <summary>
        <strong>{words.set_up}</strong>
        <span class="muted">{summaryOf(recipe)}</span>
      </summary>
      <div class="stack">
        <div class="row end">
          <NumberField
            form={form}
            label={words.from}
            unit="mm"
            value={recipe.from_mm}
            min={lowest}
            max={highest}
            onChange={(from_mm) => from_mm !== undefined && change({ from_mm })}
          />
          <NumberField
            form={form}
            label={words.to}
            unit="mm"
            value={recipe.to_mm}
            min={lowest}
            max={highest}
            onChange={(to_mm) => to_mm !== undefined && change({ to_mm })}
          />
          <NumberField
            form={form}
            label={words.step}
            unit="mm"
            value={recipe.step_mm}
            min={0.001}
            max={50}
            onChange={(step_mm) => step_mm !== undefined && change({ step_mm })}
          />
          <NumberField
            form={form}
            label={words.exposure}
            unit="µs"
            value={recipe.exposure_us}
            min={1}
            max={1e6}
            optional
            placeholder={words.automatic}
            onChange={(exposure_us) => change({ exposure_us })}
          />
        </div>
        <div class="row end">
          <div class="field">
            <label for={id}>{words.tool}</label>
            <select
              id={id}
              value={recipe.tool ?? ""}
              onChange={(event) => change({ tool: (event.currentTarget.value || undefined) as Tool | undefined })}
            >
              <option value="">{words.no_tool}</option>
              {TOOLS.map((tool) => (
                <option key={tool} value={tool}>
                  {text.value.tools[tool]}
                </option>
              ))}
            </select>
          </div>
          {recipe.tool && (
            <>
              <NumberField
                key={`nominal-${recipe.tool}`}
                form={form}
                label={words.nominal}
                unit={unit}
                value={recipe.nominal}
                optional
                onChange={(nominal) => change({ nominal })}
              />
              <NumberField
                key={`tolerance-${recipe.tool}`}
                form={form}
                label={words.tolerance}
                unit={unit}
                value={recipe.tolerance}
                min={0.0001}
                optional
                onChange={(tolerance) => change({ tolerance })}
              />
            </>
          )}
        </div>
        {recipe.tool && recipe.nominal === undefined && <p class="muted">{words.no_verdict_without_nominal}</p>}
        <p class="muted">{words.kept_here}</p>
      </div>
    </details>
  );
}

/** The set-up in one line. */
function summaryOf(recipe: Recipe): string {
  const words = text.value.operate;
  const number = (value: number) => value.toLocaleString(language.value, { maximumFractionDigits: 4 });
  const unit = recipe.tool === "angle" ? "°" : "mm";
  const signed = (value: number) => number(value).replace("-", "−");
  const scan = words.range(signed(recipe.from_mm), signed(recipe.to_mm), number(recipe.step_mm));
  if (!recipe.tool) return `${scan} · ${words.no_tool}`;
  const tolerance = recipe.tolerance === undefined ? "" : ` ± ${number(recipe.tolerance)}`;
  const nominal =
    recipe.nominal === undefined ? "" : ` ${decimal(recipe.nominal, 3, language.value)}${tolerance} ${unit}`;
  return `${scan} · ${text.value.tools[recipe.tool]}${nominal}`;
}
