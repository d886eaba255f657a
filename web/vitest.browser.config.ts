import { defineConfig } from "vitest/config";

// The real program and a real browser. Two files at a time: each waits for the other half of the time.
export default defineConfig({
  test: {
    include: ["browser/**/*.test.ts"],
    maxWorkers: 2,
    minWorkers: 1,
    testTimeout: 180_000,
    hookTimeout: 120_000,
  },
});
