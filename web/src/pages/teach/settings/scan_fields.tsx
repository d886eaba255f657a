/** How the recipe scans: range, motion, and light. */

import { useId } from "preact/hooks";
import { Choice } from "../../../components/fields/choice";
import type { Form } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { text } from "../../../text";
import { MODES } from "../../scan/acquisition";
import { LightFields } from "./light_fields";
import type { RecipeSettings } from "./recipe_settings";
import { modeOf, type ScanDraft, STAGES, scanFault, withStage } from "./scan_draft";

/** Smallest step and speed of the fields; the server checks the limits of the station. */
const SMALLEST = 0.001;

interface Properties {
  settings: RecipeSettings;
  form: Form;
}

export function ScanFields({ settings, form }: Properties) {
  const words = text.value.recipe_settings;
  const fault = scanFault(settings.scan.value);
  return (
    <fieldset class="stack">
      <legend>{words.scan}</legend>
      <p class="muted">{words.scan_hint}</p>
      <Range settings={settings} form={form} />
      <Motion settings={settings} />
      <LightFields settings={settings} form={form} />
      {fault && <p class="note">{words.faults[fault]}</p>}
    </fieldset>
  );
}

function Range({ settings, form }: Properties) {
  const words = text.value.scan;
  const draft = settings.scan.value;
  const mode = modeOf(draft);
  const unit = draft.stage === "rotary" ? "°" : "mm";
  const field = (name: "from" | "to" | "step" | "speed", per = "") => (
    <NumberField
      key={`${name}-${draft.stage}`}
      form={form}
      label={words[name]}
      unit={`${unit}${per}`}
      optional={mode === "continuous" && (name === "step" || name === "speed")}
      min={name === "step" || name === "speed" ? SMALLEST : undefined}
      value={draft[name]}
      onChange={(value) => {
        // A motion that followed from the speed stays when the speed is emptied.
        settings.changeScan(name === "speed" ? { mode, speed: value } : { [name]: value });
      }}
    />
  );
  return (
    <div class="row end">
      <Stage draft={draft} onChange={(changed) => settings.changeScan(changed)} />
      {field("from")}
      {field("to")}
      {mode === "continuous" && field("speed", "/s")}
      {field("step")}
    </div>
  );
}

function Stage({ draft, onChange }: { draft: ScanDraft; onChange: (changed: ScanDraft) => void }) {
  const words = text.value.recipe_settings;
  return (
    <Choice
      label={words.stage}
      value={draft.stage}
      options={STAGES.map((stage) => [stage, words.stages[stage]])}
      onChange={(stage) => onChange(withStage(draft, stage))}
    />
  );
}

function Motion({ settings }: { settings: RecipeSettings }) {
  const words = text.value.scan;
  const name = useId();
  return (
    <div class="row" role="radiogroup" aria-label={words.mode}>
      <span class="muted">{words.mode}</span>
      {MODES.map((mode) => (
        <label class="check" key={mode}>
          <input
            type="radio"
            name={name}
            checked={modeOf(settings.scan.value) === mode}
            onChange={() => settings.changeScan({ mode })}
          />
          {words.modes[mode]}
        </label>
      ))}
    </div>
  );
}
