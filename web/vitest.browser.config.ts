import { defineConfig } from "vitest/config";

// The real program and a real browser, which compute in turn: two files at a time use two processors.
export default defineConfig({
  test: {
    include: ["browser/**/*.test.ts"],
    globalSetup: "browser/support/calibrated.ts",
    // The files share nothing that changes: each process loads the tools of the tests once. None of the processes ends between
    // files, where it could be given another one.
    isolate: false,
    minWorkers: 2,
    maxWorkers: 2,
    testTimeout: 180_000,
    hookTimeout: 120_000,
  },
});
