import { expect, test } from "vitest";
import type { Job, Schemas } from "../../../src/api/client";
import { divergingColour, niceCeiling } from "../../../src/pages/calibration/details/heat_map";
import { orderAngles, recommendationOf } from "../../../src/pages/calibration/details/light_models";
import { recommendationText } from "../../../src/pages/calibration/details/models_view";
import type { CalibrationDocument, ModelName, Models } from "../../../src/pages/calibration/details/summary";
import { calibrationAfterRollBack } from "../../../src/pages/calibration/overview/active_card";
import { archiveType } from "../../../src/pages/calibration/overview/upload";
import { ordersFrom } from "../../../src/pages/calibration/session/new_session";
import {
  type Detection,
  requirementsOf,
  type Session,
  stepOf,
} from "../../../src/pages/calibration/session/session_state";
import {
  isKnownPose,
  meanDistance,
  STILL_FOR_MS,
  Stillness,
} from "../../../src/pages/calibration/session/stillness";
import { verificationsOf } from "../../../src/pages/calibration/steps/verifications";
import { language } from "../../../src/text";

/** Four corners of a board whose first lies at (u, v). */
function cornersAt(u: number, v: number): number[][] {
  return [
    [0, 0, u, v, 0.01],
    [1, 0, u + 50, v, 0.01],
    [0, 1, u, v + 50, 0.01],
    [1, 1, u + 50, v + 50, 0.01],
  ];
}

interface Board {
  u?: number;
  tilt_deg?: number;
  distance_mm?: number;
  cells?: number[];
  readable?: boolean;
}

function sessionOf(boards: Board[], n_views = 0): Session {
  const pose = ({ u = 100, tilt_deg, distance_mm, cells = [], readable = true }: Board, idx: number) => ({
    id: `pose ${idx}`,
    board: {
      corners: readable ? cornersAt(u, 100) : [],
      coverage_cells: cells,
      tilt_deg: tilt_deg ?? null,
      distance_mm: distance_mm ?? null,
    },
    laser: { n_segments: 5 },
  });
  const covered = new Set(boards.flatMap((board) => board.cells ?? []));
  const uncovered_cells = Array.from({ length: 48 }, (_, cell) => cell).filter((cell) => !covered.has(cell));
  const stage_views = Array.from({ length: n_views }, (_, idx) => ({ id: `view ${idx}`, position_mm: idx }));
  const met = { actual: 1, required: 1, met: boards.filter(({ readable = true }) => readable).length >= 8 };
  const needs = {
    boards: met,
    cells: met,
    tilted_boards: met,
    tilted_deg: 15,
    distance_mm: met,
    camera_met: met.met,
    laser_boards: met,
    stage_views: { actual: n_views, required: 3, met: n_views >= 3 },
  };
  return {
    id: "s",
    version: 1,
    needs,
    body: { poses: boards.map(pose), stage_views, camera: { uncovered_cells } },
  } as unknown as Session;
}

/** Eight boards that have everything a good calibration wants. */
const COMPLETE: Board[] = Array.from({ length: 8 }, (_, idx) => ({
  u: 100 * idx,
  tilt_deg: 10 + 2 * idx,
  distance_mm: 360 + 10 * idx,
  cells: Array.from({ length: 6 }, (_, row) => 8 * row + idx),
}));

const SOLVED = { id: "j", state: "succeeded", result: { kind: "calibration", id: "c" } } as unknown as Job;

test("the step follows from the session alone", () => {
  expect(stepOf(undefined, undefined, false)).toBe("check");
  expect(stepOf(sessionOf([]), undefined, false)).toBe("camera");
  expect(stepOf(sessionOf(COMPLETE.slice(0, 7)), undefined, false)).toBe("camera");
  expect(stepOf(sessionOf(COMPLETE), undefined, false)).toBe("light");
  expect(stepOf(sessionOf(COMPLETE, 1), undefined, false)).toBe("stage");
  expect(stepOf(sessionOf(COMPLETE, 5), { ...SOLVED, state: "running" }, false)).toBe("stage");
  expect(stepOf(sessionOf(COMPLETE, 5), { ...SOLVED, state: "failed" }, false)).toBe("stage");
  expect(stepOf(sessionOf(COMPLETE, 5), SOLVED, false)).toBe("verify");
  expect(stepOf(sessionOf(COMPLETE, 5), SOLVED, true)).toBe("finish");
});

test("needs are the server's; what is drawn beside them comes from the boards", () => {
  const needs = requirementsOf(sessionOf([...COMPLETE.slice(1), { readable: false }]));
  expect([needs.boards.met, needs.all, needs.tilt.values_deg.length]).toEqual([false, false, 7]);
  expect(requirementsOf(sessionOf(COMPLETE)).all).toBe(true);
});

function detectBoard(u: number, captured_ms: number): Detection {
  return { width_px: 1280, corners: cornersAt(u, 100), captured_ms } as unknown as Detection;
}

test("a board is still when its corners stay, and moving it begins anew", () => {
  const stillness = new Stillness();
  expect(stillness.follow(detectBoard(100, 0))).toBe(0);
  expect(stillness.follow(detectBoard(100.2, 600))).toBe(600);
  expect(stillness.follow(detectBoard(100, 1100))).toBeGreaterThanOrEqual(STILL_FOR_MS);
  expect(stillness.follow(detectBoard(140, 1500))).toBe(0);
  expect(stillness.follow({ ...detectBoard(140, 1900), corners: [] })).toBe(0);
  expect(stillness.follow(detectBoard(140, 2300))).toBe(0);
});

test("a pose that was captured before is not captured automatically again", () => {
  const session = sessionOf([{ u: 100 }, { u: 300 }]);
  expect(isKnownPose(detectBoard(305, 0), session)).toBe(true);
  expect(isKnownPose(detectBoard(400, 0), session)).toBe(false);
  expect(meanDistance(cornersAt(0, 0), cornersAt(3, 4))).toBe(5);
  expect(meanDistance([], cornersAt(3, 4))).toBe(Number.POSITIVE_INFINITY);
});

function models(recommended: ModelName, ...bias_mm: (number | undefined)[]): Models {
  const scores = (["planes", "pencil", "grating"] as const).map((model, idx) => ({
    model,
    held_out_bias_mm: bias_mm[idx] ?? null,
    held_out_rms_mm: null,
    held_out_rms_px: null,
    fit_rms_px: null,
    failure: bias_mm[idx] === undefined ? "too few poses" : null,
  }));
  return { scores, recommended, reason: "" };
}

test("one sentence says what the three models mean and which to use", () => {
  language.value = "en";
  const curved = recommendationOf(models("grating", 0.2711, 0.2704, 0.0107));
  expect(curved).toEqual({ kind: "curved", use: "grating", worst_mm: 0.2711, best_mm: 0.0107 });
  expect(recommendationText(curved)).toContain("271.1 µm");
  expect(recommendationText(curved)).toContain("Use “grating”");
  expect(recommendationOf(models("planes", 0.011, 0.012, 0.0105)).kind).toBe("alike");
  expect(recommendationOf(models("planes", 0.011, 0.2, 0.19)).kind).toBe("free");
  expect(recommendationOf(models("planes", 0.011, undefined, undefined)).kind).toBe("unknown");
  language.value = "de";
  expect(recommendationText(curved)).toContain("271,1 µm");
  language.value = "en";
});

test("angles of the orders are those of the grating equation", () => {
  const document = {
    orders: [-1, 0, 1],
    light: {
      model: "grating",
      wavelength_over_period: 0.5,
      axis: [0, 0, 1],
      groove: [1, 0, 0],
      normal: [0, 0, 1],
    },
    report: { light: { wavelength_over_period: [0.5, 0.001, 0.49], lines: [] } },
  } as unknown as CalibrationDocument;
  // sin 30° = 0.5, at normal incidence.
  const angles = orderAngles(document);
  expect(angles.map(({ calibrated_deg }) => calibrated_deg)).toEqual([
    expect.closeTo(-30, 9),
    expect.closeTo(0, 9),
    expect.closeTo(30, 9),
  ]);
  expect(angles[2]?.nominal_deg).toBeCloseTo((180 / Math.PI) * Math.asin(0.49), 9);
  const tilted = (degrees: number) => [
    0,
    Math.cos((degrees * Math.PI) / 180),
    Math.sin((degrees * Math.PI) / 180),
  ];
  const planes = {
    ...document,
    light: {
      model: "planes",
      planes: [
        { order: -1, normal: tilted(-20) },
        { order: 0, normal: tilted(0) },
        { order: 1, normal: tilted(20) },
      ],
    },
  } as unknown as CalibrationDocument;
  expect(orderAngles(planes).map(({ calibrated_deg }) => Math.round(calibrated_deg))).toEqual([-20, 0, 20]);
});

test("a roll-back reverts the last activation still in effect", () => {
  const entry = (action: string, to: string | null, previous_id: string | null) =>
    ({ seq: 0, action, actor: "Anna", at_ms: 0, calibration_id: to, previous_id }) as Schemas["ActivationDto"];
  expect(calibrationAfterRollBack([])).toBeUndefined();
  expect(calibrationAfterRollBack([entry("activate", "b", "a"), entry("activate", "a", null)])).toBe("a");
  // b was rolled back: the next roll-back reverts a, with nothing before it.
  const acts = [entry("roll_back", "a", "b"), entry("activate", "b", "a"), entry("activate", "a", null)];
  expect(calibrationAfterRollBack(acts)).toBeUndefined();
});

test("scales end at round numbers, colours at their ends", () => {
  expect([0.0107, 0.27, 1, 0, 9.1].map(niceCeiling)).toEqual([0.02, 0.5, 1, 1, 10]);
  expect(divergingColour(0, 1)).toBe("rgb(92 96 100)");
  expect(divergingColour(5, 1)).toBe(divergingColour(1, 1));
  expect(divergingColour(-1, 1)).not.toBe(divergingColour(1, 1));
});

test("orders and archives are read as people name them", () => {
  expect(ordersFrom("−2, −1 0;1, 2")).toEqual([-2, -1, 0, 1, 2]);
  expect(ordersFrom("")).toBeUndefined();
  expect(ordersFrom("1.5, 2")).toBeUndefined();
  expect(ordersFrom("eins")).toBeUndefined();
  expect(archiveType("Aufnahme 3.ZIP")).toBe("application/zip");
  expect(archiveType("a.tar")).toBe("application/x-tar");
  expect(archiveType("a.tar.gz")).toBeUndefined();
});

test("verifications belong to the calibration they were made with", () => {
  const job = (id: string, kind: string, calibration_id: string) =>
    ({
      id,
      kind,
      input: { kind, reference_part: "sphere", nominal_mm: 18.9, scan: { calibration_id } },
    }) as unknown as Job;
  const jobs = [job("1", "verification", "c"), job("2", "verification", "d"), job("3", "scan", "c")];
  expect(verificationsOf(jobs, "c").map((one) => one.job.id)).toEqual(["1"]);
});
