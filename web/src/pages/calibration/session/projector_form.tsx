/** The line projector of a session: its values, and the fields to enter them. */

import { useSignal } from "@preact/signals";
import { Choice } from "../../../components/fields/choice";
import type { Form } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { TextField } from "../../../components/fields/text_field";
import { language, text } from "../../../text";
import { orderName } from "../../../theme";
import { decimal } from "../../../units";
import { ordersFrom, type Projector } from "./new_session";

/** The values, read-only: those of the kind, so no grating where there is none. */
export function ProjectorFacts({ projector }: { projector: Projector }) {
  const words = text.value.calibration;
  const number = (value: number, digits: number) => decimal(value, digits, language.value);
  return (
    <dl class="facts">
      <dt>{words.projector_kind}</dt>
      <dd>{words.projector_kinds[projector.kind]}</dd>
      {projector.kind === "grating" && [
        <dt key="wavelength">{words.wavelength}</dt>,
        <dd key="wavelength-value">{number(projector.wavelength_nm, 1)} nm</dd>,
        <dt key="grating">{words.grating_lines}</dt>,
        <dd key="grating-value">
          {number(projector.grating_lines_per_mm, 1)} {words.per_mm}
        </dd>,
        <dt key="orders">{words.orders}</dt>,
        <dd key="orders-value">{projector.orders.map(orderName).join(", ")}</dd>,
      ]}
      {projector.kind === "planes" && [
        <dt key="lines">{words.laser_lines}</dt>,
        <dd key="lines-value">{projector.lines}</dd>,
      ]}
      {projector.kind !== "cross" && [
        <dt key="direction">{words.direction}</dt>,
        <dd key="direction-value">{projector.line_direction === "columns" ? words.columns : words.rows}</dd>,
      ]}
    </dl>
  );
}

interface Properties {
  form: Form;
  projector: Projector;
  onChange(projector: Projector): void;
  /** Whether the text of the orders can be read. */
  onOrders(right: boolean): void;
}

/** The fields of the station's kind of projector; the kind itself is configured with the station. */
export function ProjectorFields({ form, projector, onChange, onOrders }: Properties) {
  const words = text.value.calibration;
  const orders_text = useSignal(projector.kind === "grating" ? projector.orders.map(orderName).join(", ") : "");
  const orders = ordersFrom(orders_text.value);
  if (projector.kind === "cross") return null;
  return (
    <>
      <p>{words.projector_kinds[projector.kind]}</p>
      {projector.kind === "planes" && (
        <NumberField
          form={form}
          label={words.laser_lines}
          unit=""
          value={projector.lines}
          min={1}
          max={41}
          onChange={(value) => value !== undefined && onChange({ ...projector, lines: Math.round(value) })}
        />
      )}
      {projector.kind === "grating" && (
        <>
          <NumberField
            form={form}
            label={words.wavelength}
            unit="nm"
            value={projector.wavelength_nm}
            min={200}
            max={3000}
            onChange={(value) => value !== undefined && onChange({ ...projector, wavelength_nm: value })}
          />
          <NumberField
            form={form}
            label={words.grating_lines}
            unit={words.per_mm}
            value={projector.grating_lines_per_mm}
            min={0.1}
            max={10_000}
            onChange={(value) => value !== undefined && onChange({ ...projector, grating_lines_per_mm: value })}
          />
          <TextField
            label={words.orders}
            value={orders_text.value}
            wrong={!orders && words.orders_wrong}
            onChange={(typed) => {
              orders_text.value = typed;
              const read = ordersFrom(typed);
              onOrders(read !== undefined);
              if (read) onChange({ ...projector, orders: read });
            }}
          />
        </>
      )}
      <Choice
        label={words.direction}
        value={projector.line_direction}
        options={[
          ["rows", words.rows],
          ["columns", words.columns],
        ]}
        onChange={(line_direction) => onChange({ ...projector, line_direction })}
      />
    </>
  );
}
