/** The attributes of a recipe, row by row as they are edited. */

import type { Schemas } from "../../../api/client";

/** Largest number of attributes that the server accepts. */
export const MAX_ATTRIBUTES = 50;

/** Longest name and value of an attribute. */
export const LONGEST_NAME = 100;
export const LONGEST_VALUE = 1000;

export interface AttributeRow {
  /** Number of the row, which it keeps while others are removed. */
  row: number;
  name: string;
  value: string;
}

export type AttributeFault = "attribute_unnamed" | "attribute_twice";

type Attributes = NonNullable<Schemas["RecipeDto"]["attributes"]>;

export function rowsOf(attributes: Attributes | undefined): readonly AttributeRow[] {
  return Object.entries(attributes ?? {}).map(([name, value], row) => ({ row, name, value }));
}

/** With an empty row at the end. */
export function withRow(rows: readonly AttributeRow[]): readonly AttributeRow[] {
  const row = Math.max(-1, ...rows.map((one) => one.row)) + 1;
  return [...rows, { row, name: "", value: "" }];
}

/** The attributes; empty rows are left out. */
export function attributesOf(rows: readonly AttributeRow[]): Attributes {
  return Object.fromEntries(rows.filter(isFilled).map(({ name, value }) => [name, value]));
}

/** Why a row is not an attribute. */
export function rowFault(rows: readonly AttributeRow[], one: AttributeRow): AttributeFault | undefined {
  if (!isFilled(one)) return undefined;
  if (one.name.trim() === "") return "attribute_unnamed";
  return rows.some(({ row, name }) => row !== one.row && name === one.name) ? "attribute_twice" : undefined;
}

function isFilled({ name, value }: AttributeRow): boolean {
  return name !== "" || value !== "";
}
