/** The client's types and the names of events are those of the documents; `npm run schema` writes the types anew. */

import { readFileSync } from "node:fs";
import { join } from "node:path";
import openapiTS, { astToString, COMMENT_HEADER } from "openapi-typescript";
import { expect, test } from "vitest";
import { health as german } from "../src/text/de/health";
import { health as english } from "../src/text/en/health";

const ROOT = join(import.meta.dirname, "../..");

test("src/api/schema.ts follows openapi/openapi.json", async () => {
  const document = JSON.parse(readFileSync(join(ROOT, "openapi/openapi.json"), "utf8"));
  const written = COMMENT_HEADER + astToString(await openapiTS(document));
  expect(readFileSync(join(ROOT, "web/src/api/schema.ts"), "utf8")).toBe(written);
});

test("every event of openapi/events.md has its label in both languages", () => {
  const document = readFileSync(join(ROOT, "openapi/events.md"), "utf8");
  const kinds = [...document.matchAll(/^\| `([a-z_.]+)` \|/gm)].map(([, kind]) => kind ?? "");
  expect(kinds.length).toBeGreaterThan(30);
  for (const { event_kinds } of [english, german])
    expect(kinds.filter((kind) => !(kind in event_kinds))).toEqual([]);
});
