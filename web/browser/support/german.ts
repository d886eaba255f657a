/** What a German reader must not meet, and jobs in all their states to look for it in. */

import type { Page } from "playwright-core";
import type { Job } from "../../src/api/client";

/** Words that English texts can hardly do without, and German ones do not have. */
const ENGLISH =
  /\b(the|of|and|with|is|are|to|left|done|failed|cancelled|waiting|running|pose|board|pictures|reading)\b/i;

/** Texts and labels that are seen within `selector` and are English, but for what is marked so. */
export async function englishIn(page: Page, selector: string): Promise<string[]> {
  const shown = await page
    .locator(selector)
    .evaluateAll((parts) =>
      parts.flatMap((part) =>
        [...part.querySelectorAll("*")]
          .filter((element) => !element.closest("[lang=en], .mono, pre"))
          .flatMap((element) => [
            ...[...element.childNodes]
              .filter((node) => node.nodeType === Node.TEXT_NODE)
              .map((node) => node.textContent),
            ...["aria-label", "title", "placeholder"].map((name) => element.getAttribute(name)),
          ]),
      ),
    );
  return shown.map((text) => (text ?? "").trim()).filter((text) => ENGLISH.test(text));
}

export const AT_WORK: Job = {
  id: "00000000-0000-7000-8000-000000000001",
  kind: "calibration",
  state: "running",
  progress: 0.2,
  message: "pose 3 of 12: exposing the board",
  step: { phase: "exposing_board", number: 3, total: 12 },
  remaining_s: 21,
  source: "rest",
  input: { kind: "calibration", source: { kind: "station" }, leave_out_unreadable: false },
  created_at_ms: 1_795_000_000_000,
  started_at_ms: 1_795_000_000_100,
};

/** A job of every kind that succeeded, and one of every other end. */
export const ENDED: readonly Job[] = [
  ...["calibration", "scan", "recomputation", "verification", "export", "inspection", "re_evaluation"].map(
    (kind) => ({
      kind,
      state: "succeeded" as const,
      message: "it is done and the cloud is there",
      result: { kind: "capture", id: "x", href: "/api/v1/captures/x" },
    }),
  ),
  { kind: "scan", state: "cancelled" as const, message: "the station was stopped by Anna" },
  { kind: "scan", state: "interrupted" as const, message: "interrupted: the server ended while it ran" },
  {
    kind: "scan",
    state: "failed" as const,
    message: "the stage is not there",
    problem: {
      type: "urn:sheaf:problem:device-fault",
      title: "Device fault",
      status: 503,
      detail: "the stage is not there",
      remedy: "see to the cable of the stage",
    },
  },
].map((job, at) => ({ ...AT_WORK, step: null, ended_at_ms: 1_795_000_009_000, ...job, id: `ended-${at}` }) as Job);
