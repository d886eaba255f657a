/** The description of a calibration board, and the form to enter one. */

import { Choice } from "../../../components/fields/choice";
import type { Form } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { TextField } from "../../../components/fields/text_field";
import { language, text } from "../../../text";
import { decimal } from "../../../units";
import { ofKind, sidesOf, TARGET_KINDS, type Target, withSides } from "./target";

/** The board of a session. */
export function TargetFacts({ target }: { target: Target }) {
  const words = text.value.calibration.targets[target.kind];
  const number = (value: number) => decimal(value, 3, language.value);
  const [along_row, along_column] = sidesOf(target);
  const square = along_row === along_column ? number(along_row) : `${number(along_row)} × ${number(along_column)}`;
  const counts =
    target.kind === "chessboard" ? [target.inner_columns, target.inner_rows] : [target.columns, target.rows];
  return (
    <dl class="facts">
      <dt>{text.value.calibration.target_kind}</dt>
      <dd>{words.name}</dd>
      <dt>{words.columns}</dt>
      <dd>{counts[0]}</dd>
      <dt>{words.rows}</dt>
      <dd>{counts[1]}</dd>
      <dt>{words.square}</dt>
      <dd>{square} mm</dd>
      {target.kind === "charuco" && [
        <dt key="marker">{text.value.calibration.marker}</dt>,
        <dd key="marker-mm">{number(target.marker_mm)} mm</dd>,
        <dt key="dictionary">{text.value.calibration.dictionary}</dt>,
        <dd key="dictionary-name">{target.dictionary}</dd>,
      ]}
      {"diameter_mm" in target && [
        <dt key="diameter">{text.value.calibration.diameter}</dt>,
        <dd key="diameter-mm">{number(target.diameter_mm)} mm</dd>,
      ]}
    </dl>
  );
}

interface Properties {
  form: Form;
  target: Target;
  onChange: (target: Target) => void;
}

/** Form fields for a board of any kind. */
export function TargetFields({ form, target, onChange }: Properties) {
  const words = text.value.calibration;
  const of_kind = words.targets[target.kind];
  const [along_row, along_column] = sidesOf(target);
  const changeSides = (row: number, column: number) => onChange(withSides(target, [row, column]));
  return (
    <>
      <Choice
        label={words.target_kind}
        value={target.kind}
        options={TARGET_KINDS.map((kind) => [kind, words.targets[kind].name])}
        onChange={(kind) => onChange(ofKind(kind, target))}
      />
      <p class="muted">{of_kind.hint}</p>
      <Counts form={form} target={target} onChange={onChange} />
      <Length
        form={form}
        label={of_kind.square}
        value={along_row}
        onChange={(row) => changeSides(row, along_column === along_row ? row : along_column)}
      />
      <Length
        form={form}
        label={words.square_along_column}
        value={along_column}
        onChange={(column) => changeSides(along_row, column)}
      />
      {target.kind === "charuco" && (
        <>
          <Length
            form={form}
            label={words.marker}
            value={target.marker_mm}
            onChange={(marker_mm) => onChange({ ...target, marker_mm })}
          />
          <TextField
            label={words.dictionary}
            value={target.dictionary}
            onChange={(typed) => onChange({ ...target, dictionary: typed.trim() })}
          />
        </>
      )}
      {"diameter_mm" in target && (
        <Length
          form={form}
          label={words.diameter}
          value={target.diameter_mm}
          onChange={(diameter_mm) => onChange({ ...target, diameter_mm })}
        />
      )}
    </>
  );
}

function Counts({ form, target, onChange }: Properties) {
  const words = text.value.calibration.targets[target.kind];
  const count = (label: string, value: number, change: (value: number) => Target) => (
    <NumberField
      form={form}
      label={label}
      whole
      unit={words.unit}
      value={value}
      min={2}
      max={1000}
      onChange={(value) => value !== undefined && onChange(change(value))}
    />
  );
  if (target.kind === "chessboard") {
    return (
      <>
        {count(words.columns, target.inner_columns, (inner_columns) => ({ ...target, inner_columns }))}
        {count(words.rows, target.inner_rows, (inner_rows) => ({ ...target, inner_rows }))}
      </>
    );
  }
  return (
    <>
      {count(words.columns, target.columns, (columns) => ({ ...target, columns }))}
      {count(words.rows, target.rows, (rows) => ({ ...target, rows }))}
    </>
  );
}

function Length(properties: { form: Form; label: string; value: number; onChange: (value: number) => void }) {
  return (
    <NumberField
      form={properties.form}
      label={properties.label}
      unit="mm"
      value={properties.value}
      min={0.01}
      max={1000}
      onChange={(value) => value !== undefined && properties.onChange(value)}
    />
  );
}
