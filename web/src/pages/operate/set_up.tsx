/** The collapsible form of the measurement plan, which is stored on the server. */

import { useId } from "preact/hooks";
import { Choice } from "../../components/fields/choice";
import type { Form } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import { ProblemCard } from "../../components/problem";
import { TOOLS, type Tool } from "../../state/choices";
import type { MeasurementPlan, Plan } from "../../state/records/measurement_plan";
import { language, text } from "../../text";
import { decimal } from "../../units";
import { type Characteristic, freeName, planRange, type Range, rangeOf, withChange } from "./plan";

interface Properties {
  plan: MeasurementPlan;
  form: Form;
  /** Travel range of the stage, in its unit. */
  travel: readonly number[];
}

export function SetUp({ plan, form, travel }: Properties) {
  const words = text.value.operate;
  const shown = plan.plan.value;
  return (
    <details class="card set-up" data-saved={!plan.unsaved.value}>
      <summary>
        <strong>{words.set_up}</strong>
        <span class="muted">{shown && summaryOf(shown)}</span>
      </summary>
      {plan.problem.value && <ProblemCard problem={plan.problem.value} />}
      {shown && <Fields shown={shown} form={form} change={(part) => plan.change(part)} travel={travel} />}
    </details>
  );
}

interface FieldsProperties {
  shown: Plan;
  form: Form;
  change: (part: Partial<Plan>) => void;
  travel: readonly number[];
}

function Fields({ shown, form, change, travel }: FieldsProperties) {
  const words = text.value.operate;
  const [lowest = -1e4, highest = 1e4] = travel;
  const range = rangeOf(shown);
  const { from, to, step, unit } = range;
  const changeRange = (part: Partial<Range>) => change(planRange({ ...range, ...part }));
  const measure = shown.measure ?? [];
  const replace = (at: number, one: Characteristic | undefined) =>
    change({ measure: measure.flatMap((known, idx) => (idx === at ? (one ?? []) : known)) });
  return (
    <div class="stack">
      <div class="row end">
        <NumberField
          form={form}
          label={words.from}
          unit={unit}
          value={from}
          min={lowest}
          max={highest}
          onChange={(from) => from !== undefined && changeRange({ from })}
        />
        <NumberField
          form={form}
          label={words.to}
          unit={unit}
          value={to}
          min={lowest}
          max={highest}
          onChange={(to) => to !== undefined && changeRange({ to })}
        />
        <NumberField
          form={form}
          label={words.step}
          unit={unit}
          value={step}
          min={0.001}
          max={50}
          onChange={(step) => step !== undefined && changeRange({ step })}
        />
        <NumberField
          form={form}
          label={words.exposure}
          unit="µs"
          value={shown.exposure_us ?? undefined}
          min={1}
          max={1e6}
          optional
          placeholder={words.automatic}
          onChange={(exposure_us) => change({ exposure_us: exposure_us ?? null })}
        />
      </div>
      {measure.map((one, at) => (
        <CharacteristicRow
          key={`${at}-${one.tool}`}
          one={one}
          form={form}
          others={measure.filter((other) => other !== one)}
          onChange={(next) => replace(at, next)}
        />
      ))}
      {measure.length === 0 && <p class="muted">{words.no_tool}</p>}
      <div>
        <button
          type="button"
          onClick={() => {
            const tool = TOOLS.find((tool) => !measure.some((one) => one.tool === tool)) ?? "sphere";
            change({ measure: [...measure, named(measure, tool)] });
          }}
        >
          {words.add_measurement}
        </button>
      </div>
      <p class="muted">{words.stored_on_server}</p>
    </div>
  );
}

/** A characteristic of a tool, without limits yet. */
function named(others: readonly Characteristic[], tool: Tool): Characteristic {
  const name = freeName(others, tool);
  return { tool, ...(name !== undefined && { name }) };
}

interface RowProperties {
  one: Characteristic;
  form: Form;
  others: readonly Characteristic[];
  /** Undefined: removed. */
  onChange: (next: Characteristic | undefined) => void;
}

function CharacteristicRow({ one, form, others, onChange }: RowProperties) {
  const words = text.value.operate;
  const id = useId();
  const unit = one.tool === "angle" ? "°" : "mm";
  const judged = one.tool === "flatness" || one.nominal_mm != null;
  return (
    <div class="row end characteristic" data-tool={one.tool}>
      <Choice
        label={words.tool}
        value={one.tool}
        options={TOOLS.map((tool) => [tool, text.value.tools[tool]])}
        onChange={(tool) => onChange(named(others, tool))}
      />
      {one.name != null && (
        <div class="field">
          <label for={`${id}-name`}>{words.characteristic_name}</label>
          <input
            id={`${id}-name`}
            value={one.name}
            maxLength={100}
            onChange={(event) => {
              const name = event.currentTarget.value.trim();
              if (name !== "") onChange({ ...one, name });
            }}
          />
        </div>
      )}
      {one.tool !== "flatness" && (
        <NumberField
          form={form}
          label={words.nominal}
          unit={unit}
          value={one.nominal_mm ?? undefined}
          optional
          onChange={(nominal) => onChange(withChange(one, { nominal_mm: nominal ?? null }))}
        />
      )}
      {judged && (
        <NumberField
          form={form}
          label={words.tolerance}
          unit={unit}
          value={one.tolerance_mm ?? undefined}
          min={0.0001}
          optional
          onChange={(tolerance) => onChange(withChange(one, { tolerance_mm: tolerance ?? null }))}
        />
      )}
      <button type="button" class="quiet" onClick={() => onChange(undefined)}>
        {words.remove_measurement}
      </button>
      {!judged && <p class="muted">{words.no_verdict_without_nominal}</p>}
    </div>
  );
}

/** The plan in one line. */
function summaryOf(plan: Plan): string {
  const words = text.value.operate;
  const number = (value: number) => value.toLocaleString(language.value, { maximumFractionDigits: 4 });
  const signed = (value: number) => number(value).replace("-", "−");
  const { from, to, step, unit } = rangeOf(plan);
  const scan = words.range(signed(from), signed(to), number(step), unit === "mm" ? " mm" : unit);
  const measure = plan.measure ?? [];
  if (measure.length === 0) return `${scan} · ${words.no_tool}`;
  const measured = measure.map(({ tool, name, nominal_mm, tolerance_mm }) => {
    const unit = tool === "angle" ? "°" : "mm";
    const nominal = nominal_mm == null ? "" : ` ${decimal(nominal_mm, 3, language.value)}`;
    const tolerance = tolerance_mm == null ? "" : ` ± ${number(tolerance_mm)}`;
    const limits = nominal + tolerance === "" ? "" : `${nominal}${tolerance} ${unit}`;
    return `${text.value.tools[tool]}${name == null ? "" : ` “${name}”`}${limits}`;
  });
  return `${scan} · ${measured.join(", ")}`;
}
