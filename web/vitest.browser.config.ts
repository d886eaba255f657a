import { defineConfig } from "vitest/config";

// The real program and a real browser: one file after the other, so that each has the machine to itself.
export default defineConfig({
  test: {
    include: ["browser/**/*.test.ts"],
    fileParallelism: false,
    testTimeout: 180_000,
    hookTimeout: 120_000,
    // A neighbour on a shared machine can starve a browser for longer than a wait lasts; a defect fails twice.
    retry: 1,
  },
});
