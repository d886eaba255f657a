/** Names of doors and attempts, relative times, and paging of deliveries. */

import createClient from "openapi-fetch";
import { afterEach, expect, test } from "vitest";
import type { paths } from "../../src/api/schema";
import { relativeTime } from "../../src/components/relative_time";
import { attemptName, eventName, kindName, setAside } from "../../src/pages/settings/doors/door_facts";
import { concernsDoors, type Delivery, type Door, readDeliveries } from "../../src/state/records/doors";
import { language } from "../../src/text";

const DOOR: Door = {
  name: "mes",
  kind: "webhook",
  target: "https://mes.example.com/hook",
  state: "delivering",
  n_behind: 0,
  n_delivered: 12,
  n_waiting: 0,
  n_dead: 0,
  attempts: [],
};

afterEach(() => {
  language.value = "en";
});

test("a relative time is shown in its largest whole unit, in the language of the page", () => {
  const check = (distance_s: number, en: string, de: string) => {
    expect(relativeTime(1000 * distance_s, 0, "en"), `${distance_s} s`).toBe(en);
    expect(relativeTime(1000 * distance_s, 0, "de"), `${distance_s} s`).toBe(de);
  };
  check(0, "now", "jetzt");
  check(-0.9, "now", "jetzt");
  check(0.9, "now", "jetzt");
  check(-1, "1 second ago", "vor 1 Sekunde");
  check(12.7, "in 12 seconds", "in 12 Sekunden");
  check(-59.9, "59 seconds ago", "vor 59 Sekunden");
  check(60, "in 1 minute", "in 1 Minute");
  check(-3599, "59 minutes ago", "vor 59 Minuten");
  check(47 * 3600, "in 47 hours", "in 47 Stunden");
  check(-2 * 86_400, "2 days ago", "vor 2 Tagen");
});

test("attempts and kinds are named in the language of the page; unknown ones keep their own name", () => {
  const delivered = { at_ms: 0, seq: 4711, kind: "inspection.finished" };
  expect(attemptName(delivered)).toBe("4711 · part inspected");
  expect(attemptName({ at_ms: 0 })).toBe("Test message");
  expect(attemptName({ at_ms: 0, seq: 3 })).toBe("3");
  expect(eventName("part.painted")).toBe("part.painted");
  language.value = "de";
  expect(attemptName(delivered)).toBe("4711 · Teil geprüft");
  expect(attemptName({ at_ms: 0, seq: null })).toBe("Testnachricht");
  expect([kindName("folder"), kindName("carrier pigeon")]).toEqual(["Ordner", "carrier pigeon"]);
});

test("deliveries set aside are those that are tried again and the dead letters", () => {
  expect(setAside({ ...DOOR, n_waiting: 2, n_dead: 3 })).toBe(5);
});

test("events of doors and deliveries concern the doors, others do not", () => {
  const kinds = ["door.waiting", "door.recovered", "delivery.dead", "delivery.resent", "delivery.deleted"];
  expect(kinds.every((kind) => concernsDoors({ kind }))).toBe(true);
  expect(concernsDoors({ kind: "inspection.finished" })).toBe(false);
});

/** A server with this many deliveries set aside; records its queries. */
function serverWith(n_deliveries: number) {
  const queries: string[] = [];
  const api = createClient<paths>({
    baseUrl: "http://sheaf.example",
    fetch: async ({ url }) => {
      const { search, searchParams } = new URL(url);
      queries.push(search);
      const [after, limit] = ["after_seq", "limit"].map((name) => Number(searchParams.get(name)));
      const first = (after ?? 0) + 1;
      const last = Math.min(n_deliveries, first + (limit ?? 0) - 1);
      const items = Array.from({ length: last - first + 1 }, (_, idx) => delivery(first + idx));
      return Response.json({ items, ...(last < n_deliveries && { next: "/…" }) });
    },
  });
  return { api, queries };
}

function delivery(seq: number): Delivery {
  const event = { kind: "door.recovered", body: {}, seq, subject: "mes", at_ms: 0 } as const;
  return { event, state: "dead", n_attempts: 8, reason: "HTTP 422" };
}

test("as many deliveries are read as are to be shown, in pages as large as the server permits", async () => {
  const few = serverWith(3);
  const all = await readDeliveries(few.api, "mes", 50);
  expect(all.items.map(({ event }) => event.seq)).toEqual([1, 2, 3]);
  expect([all.has_more, few.queries]).toEqual([false, ["?limit=50&after_seq=0"]]);

  const many = serverWith(500);
  const some = await readDeliveries(many.api, "mes", 250);
  expect([some.items.length, some.items.at(-1)?.event.seq, some.has_more]).toEqual([250, 250, true]);
  expect(many.queries).toEqual(["?limit=200&after_seq=0", "?limit=50&after_seq=200"]);
});
