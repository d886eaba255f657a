/** Values of characteristics as text. */

import type { Schemas } from "../../api/client";
import type { CharacteristicResult } from "../../state/records/inspections";
import { language, text } from "../../text";
import { decimal, length } from "../../units";

/** A value of a characteristic with its unit; "–" if undefined. */
export function withUnit(value: number | null | undefined, { unit }: Pick<CharacteristicResult, "unit">): string {
  return value == null ? "–" : `${decimal(value, 3, language.value)} ${unit}`;
}

/** U with its unit: small lengths in µm. */
export function uncertaintyOf({ expanded_uncertainty: u, unit }: CharacteristicResult): string {
  return unit === "mm" ? length(u, language.value) : withUnit(u, { unit });
}

/** Display name of the measured quantity. */
export function measureName({ measure }: Pick<CharacteristicResult, "measure">): string {
  return text.value.inspections.measures[measure] ?? measure;
}

type ViolatedRule = Schemas["ViolatedRule"];

/** Decimals of values, as on the page of the control chart. */
const CHART_DECIMALS = 4;

/** A run rule in the words of the page of the control chart, with its number. */
export function patternOf({ rule }: Pick<ViolatedRule, "rule">): string {
  const words = text.value.statistics;
  const pattern = words.rules[rule];
  return pattern === undefined ? `${words.rule} ${rule}` : text.value.inspections.rule_numbered(rule, pattern);
}

/** The value that completed a pattern, with centre line and σ of the chart at that time. */
export function chartThen(violated: Pick<ViolatedRule, "value" | "centre" | "sigma" | "unit">): string {
  const { value, centre, sigma, unit } = violated;
  const written = (number: number) => `${decimal(number, CHART_DECIMALS, language.value)} ${unit}`;
  const spread = unit === "mm" ? length(sigma, language.value) : written(sigma);
  return text.value.inspections.chart_was(written(value), written(centre), spread);
}
