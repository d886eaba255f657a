import { readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { brotliCompressSync, gzipSync } from "node:zlib";
import { defineConfig, type Plugin } from "vite";

/** The whole page with everything it may ever load, gzipped: a promise of the product. */
const BUDGET_BYTES = 256 * 1024;

/** File types that shrink. */
const TEXT = /\.(html|js|css|svg|json|webmanifest)$/;

export default defineConfig({
  base: "./",
  // Chunks carry hashes in their names, so the server lets browsers keep them for ever.
  build: {
    target: "es2022",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    reportCompressedSize: false,
    // A file of its own costs a page more than a few kilobytes that it may not need.
    rollupOptions: { output: { experimentalMinChunkSize: 7000 } },
  },
  esbuild: { jsx: "automatic", jsxImportSource: "preact", legalComments: "none" },
  plugins: [textsInPairs(), compressed()],
  server: { proxy: { "/api": { target: "http://127.0.0.1:8080", ws: true }, "/health": "http://127.0.0.1:8080" } },
});

/**
 * Places the German texts of each page right behind the English ones: gzip finds the names that both share only within
 * 32 KiB.
 */
function textsInPairs(): Plugin {
  return {
    name: "sheaf-texts-in-pairs",
    apply: "build",
    transform(code, id) {
      const name = /\/text\/de\/(\w+)\.ts$/.exec(id)?.[1];
      // The order of modules in a file is that of their imports; the catalogue itself imports all of its texts.
      return name && name !== "index" ? { code: `import "../en/${name}";\n${code}`, map: null } : null;
    },
  };
}

/** Writes `.gz` and `.br` beside every text once, so that the server never compresses; holds the budget. */
function compressed(): Plugin {
  return {
    name: "sheaf-compressed",
    apply: "build",
    writeBundle(options) {
      const folder = options.dir ?? "dist";
      let total = 0;
      for (const file of filesIn(folder).filter((file) => TEXT.test(file))) {
        const bytes = readFileSync(file);
        const gzipped = gzipSync(bytes, { level: 9 });
        total += gzipped.length;
        writeFileSync(`${file}.gz`, gzipped);
        writeFileSync(`${file}.br`, brotliCompressSync(bytes));
      }
      if (total > BUDGET_BYTES) {
        this.error(`the page has ${total} bytes gzipped, more than the ${BUDGET_BYTES} promised`);
      }
      this.info(`${total} bytes gzipped of ${BUDGET_BYTES}`);
    },
  };
}

function filesIn(folder: string): string[] {
  return readdirSync(folder).flatMap((name) => {
    const path = join(folder, name);
    return statSync(path).isDirectory() ? filesIn(path) : [path];
  });
}
