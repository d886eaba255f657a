/** The kinds of calibration boards, with their numbers of points and their default dimensions. */

import type { Schemas } from "../../../api/client";

export type Target = Schemas["TargetDto"];
export type TargetKind = Target["kind"];

export const TARGET_KINDS: readonly TargetKind[] = ["chessboard", "charuco", "circles", "asymmetric_circles"];

/** Number of corners or circle centres on the board. */
export function pointsOf(target: Target): number {
  switch (target.kind) {
    case "chessboard":
      return target.inner_columns * target.inner_rows;
    case "charuco":
      return (target.columns - 1) * (target.rows - 1);
    default:
      return target.columns * target.rows;
  }
}

/** Square size or centre spacing along a row and along a column, mm. */
export function sidesOf({ square_mm }: Target): [number, number] {
  if (typeof square_mm === "number") return [square_mm, square_mm];
  const [along_row = 0, along_column = along_row] = square_mm;
  return [along_row, along_column];
}

/** The board with another square size or spacing. */
export function withSides(target: Target, [along_row, along_column]: [number, number]): Target {
  return { ...target, square_mm: along_row === along_column ? along_row : [along_row, along_column] };
}

/** A board of another kind with the same square size or spacing, and the defaults of `sheaf target`. */
export function ofKind(kind: TargetKind, target: Target): Target {
  const { square_mm } = target;
  const side_mm = Math.min(...sidesOf(target));
  const share = (part: number) => Number((part * side_mm).toFixed(2));
  switch (kind) {
    case "chessboard":
      return { kind, inner_columns: 11, inner_rows: 8, square_mm };
    case "charuco":
      return { kind, columns: 12, rows: 9, square_mm, marker_mm: share(0.7), dictionary: "DICT_5X5_100" };
    case "circles":
      return { kind, columns: 9, rows: 7, square_mm, diameter_mm: share(0.6) };
    case "asymmetric_circles":
      return { kind, columns: 4, rows: 11, square_mm, diameter_mm: share(0.85) };
  }
}
