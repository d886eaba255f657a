import { defineConfig } from "vitest/config";

// The real program and a real browser: one file after the other, so that each has the machine to itself.
export default defineConfig({
  test: {
    include: ["browser/**/*.test.ts"],
    globalSetup: "browser/calibrated.ts",
    fileParallelism: false,
    testTimeout: 180_000,
    hookTimeout: 120_000,
  },
});
