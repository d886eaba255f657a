import { defineConfig } from "vitest/config";

// The real program and a real browser, which compute in turn: two files at a time use two processors.
export default defineConfig({
  test: {
    include: ["browser/**/*.test.ts"],
    globalSetup: "browser/support/calibrated.ts",
    minWorkers: 1,
    maxWorkers: 2,
    testTimeout: 180_000,
    hookTimeout: 120_000,
  },
});
