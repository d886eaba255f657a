import { expect, test } from "vitest";
import { lossesOf, nothingFreed } from "../../../src/pages/live/recordings/recording_facts";

test("losses are all exposures that are not in the recording", () => {
  expect(lossesOf({ lost: { camera: 1, incomplete: 2, no_buffer: 4, malformed: 8, recorder: 16 } })).toBe(31);
});

test("a recording without a file frees nothing", () => {
  expect([nothingFreed({ file: null }), nothingFreed({ file: "/api/v1/recordings/1/file" })]).toEqual([
    true,
    false,
  ]);
});
