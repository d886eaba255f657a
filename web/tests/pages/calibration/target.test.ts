import { expect, test } from "vitest";
import {
  ofKind,
  pointsOf,
  sidesOf,
  TARGET_KINDS,
  type Target,
  withSides,
} from "../../../src/pages/calibration/session/target";

const board: Target = { kind: "chessboard", inner_columns: 11, inner_rows: 8, square_mm: 12 };

test("every kind of board says how many points it shows", () => {
  const points = TARGET_KINDS.map((kind) => pointsOf(ofKind(kind, board)));
  expect(points).toEqual([88, 88, 63, 44]);
});

test("two sides are one number until a printer has stretched them, and stay when the kind changes", () => {
  expect(sidesOf(board)).toEqual([12, 12]);
  const stretched = withSides(board, [12, 12.1]);
  expect(stretched.square_mm).toEqual([12, 12.1]);
  expect(sidesOf(ofKind("circles", stretched))).toEqual([12, 12.1]);
  expect(withSides(stretched, [12, 12])).toEqual(board);
});

test("markers and discs fit between their neighbours", () => {
  expect(ofKind("charuco", board)).toMatchObject({ marker_mm: 8.4 });
  expect(ofKind("circles", board)).toMatchObject({ diameter_mm: 7.2 });
});
