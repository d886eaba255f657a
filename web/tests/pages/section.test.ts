import { describe, expect, it } from "vitest";
import { sectionOf } from "../../src/pages/result/section";

const frame = {
  calibration_id: "c",
  sequence: 7,
  position_mm: -3.2,
  captured_at_ns: 5_000_000,
  order: [1, -1, 1, 0, -1],
  u_px: [30.2, 10.4, 20.1, 15, 40.6],
  v_px: [5, 1, 5, 3, 1],
  x_mm: [3, 1, 2, 1.5, 4],
  y_mm: [0, 0, 0, 0, 0],
  z_mm: [13, 11, 12, 11.5, 14],
  sigma_mm: [0.03, 0.01, 0.02, 0.015, 0.04],
};

describe("section of a stored scan", () => {
  it("lays the points order by order along their lines", () => {
    const section = sectionOf(frame);
    expect(section.orders).toEqual([
      { order: -1, first: 0, n_points: 2 },
      { order: 0, first: 2, n_points: 1 },
      { order: 1, first: 3, n_points: 2 },
    ]);
    expect([...section.x_mm]).toEqual([1, 4, 1.5, 2, 3]);
    expect([...section.z_mm]).toEqual([11, 14, 11.5, 12, 13]);
    expect([...section.pixels]).toEqual([10, 1, 41, 1, 15, 3, 20, 5, 30, 5]);
    expect(section.along).toBe("x");
    expect(section.position_mm).toBe(-3.2);
  });

  it("takes lines along columns by their rows", () => {
    const section = sectionOf({ ...frame, u_px: frame.v_px, v_px: frame.u_px });
    expect(section.along).toBe("y");
    expect([...section.x_mm]).toEqual([1, 4, 1.5, 2, 3]);
  });

  it("is empty where a frame shows nothing", () => {
    const none: number[] = [];
    const section = sectionOf({
      ...frame,
      order: none,
      u_px: none,
      v_px: none,
      x_mm: none,
      y_mm: none,
      z_mm: none,
      sigma_mm: none,
    });
    expect(section.orders).toEqual([]);
    expect(section.z_mm).toHaveLength(0);
  });
});
