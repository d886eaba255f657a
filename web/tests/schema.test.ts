/** The client's types are those of the document; `npm run schema` writes them anew. */

import { readFileSync } from "node:fs";
import { join } from "node:path";
import openapiTS, { astToString, COMMENT_HEADER } from "openapi-typescript";
import { expect, test } from "vitest";

const ROOT = join(import.meta.dirname, "../..");

test("src/api/schema.ts follows openapi/openapi.json", async () => {
  const document = JSON.parse(readFileSync(join(ROOT, "openapi/openapi.json"), "utf8"));
  const written = COMMENT_HEADER + astToString(await openapiTS(document));
  expect(readFileSync(join(ROOT, "web/src/api/schema.ts"), "utf8")).toBe(written);
});
