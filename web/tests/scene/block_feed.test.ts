/** Every block of a scan once and in order, whatever the connection does. */

import { expect, test } from "vitest";
import { BlockFeed, type PointsPage } from "../../src/scene/cloud/block_feed";
import { block, blockBytes } from "./blocks";

const SCAN = "01890a5d-ac96-774b-bcce-b302099a8057";
const OTHER = "01890a5d-ac96-774b-bcce-b302099a8058";

/** A block of one point; `noise` tells a row that was taken again from the first one. */
function row(number: number, noise = 0, scan_id = SCAN) {
  const point = { order: 0, intensity: noise, sigma_class: 9, along_px: 5 };
  return {
    block: number,
    frame: number,
    position_mm: number,
    scan_id,
    points: [{ ...point, xyz_mm: [1, 2, 3] as [number, number, number] }],
  };
}

/** A server that has some rows, and a feed that writes down what it shows. */
function station(rows: ReturnType<typeof row>[], complete = false) {
  const server = { rows, complete, n_asked: 0 };
  const shown: string[] = [];
  const fetchPage = async (scan_id: string, from_block: number): Promise<PointsPage> => {
    server.n_asked += 1;
    const wanted = server.rows.filter((one) => one.scan_id === scan_id && one.block >= from_block).slice(0, 3);
    const bytes = wanted.map((one) => new Uint8Array(blockBytes(one)));
    const buffer = await new Blob(bytes).arrayBuffer();
    const next_block = wanted.length > 0 ? (wanted.at(-1)?.block ?? 0) + 1 : 0;
    const all = next_block >= server.rows.length || wanted.length === 0;
    return { buffer, next_block, complete: server.complete && all };
  };
  const feed = new BlockFeed(fetchPage, {
    onBlock: (one) =>
      shown.push(`${one.block}/${new DataView(one.points.buffer, one.points.byteOffset).getUint16(6, true)}`),
    onReset: (scan_id) => shown.splice(0, shown.length, ...(scan_id === SCAN ? [] : ["other"])),
    onProblem: (cause) => {
      throw cause;
    },
  });
  return { server, feed, shown };
}

const settled = () => new Promise((resolve) => setTimeout(resolve, 20));

test("a page opened in the middle of a scan asks for what it missed and then follows", async () => {
  const { feed, shown, server } = station([0, 1, 2, 3, 4].map((number) => row(number)));
  feed.announce({ scan_id: SCAN, running: true, n_blocks: 5, next_block: 5 });
  feed.receive(block(row(5)));
  server.rows.push(row(5));
  await settled();
  feed.receive(block(row(6)));
  expect(shown).toEqual(["0/0", "1/0", "2/0", "3/0", "4/0", "5/0", "6/0"]);
  expect([feed.next_block, feed.running]).toEqual([7, true]);
});

test("blocks that come twice, or of another scan, are left out", () => {
  const { feed, shown } = station([]);
  feed.announce({ scan_id: SCAN, running: true, n_blocks: 0, next_block: 0 });
  for (const number of [0, 1, 1, 0]) feed.receive(block(row(number)));
  feed.receive(block(row(2, 0, OTHER)));
  expect(shown).toEqual(["0/0", "1/0"]);
});

test("a lost connection costs no block and doubles none", async () => {
  const { feed, shown, server } = station([row(0), row(1)]);
  feed.announce({ scan_id: SCAN, running: true, n_blocks: 0, next_block: 0 });
  feed.receive(block(row(0)));
  feed.receive(block(row(1)));
  server.rows.push(row(2), row(3), row(4));
  feed.reconnected();
  feed.announce({ scan_id: SCAN, running: true, n_blocks: 5, next_block: 5 });
  await settled();
  feed.receive(block(row(5)));
  expect(shown).toEqual(["0/0", "1/0", "2/0", "3/0", "4/0", "5/0"]);
});

test("rows that were taken again after a crash replace those that were lost with it", async () => {
  const { feed, shown, server } = station([row(0), row(1), row(2)]);
  feed.announce({ scan_id: SCAN, running: true, n_blocks: 0, next_block: 0 });
  for (const number of [0, 1, 2]) feed.receive(block(row(number)));
  // The row 2 was not yet on the disk; the scan was resumed before this page was back.
  server.rows = [row(0), row(1), row(2, 7), row(3, 7)];
  feed.reconnected();
  await settled();
  expect(shown).toEqual(["0/0", "1/0", "2/7", "3/7"]);
});

test("after a restart the image stays until the scan is resumed, then begins anew", async () => {
  const { feed, shown, server } = station([row(0), row(1)]);
  feed.announce({ scan_id: SCAN, running: true, n_blocks: 0, next_block: 0 });
  feed.receive(block(row(0)));
  feed.receive(block(row(1)));
  server.rows = [];
  server.complete = true;
  feed.reconnected();
  await settled();
  expect([shown, feed.running]).toEqual([["0/0", "1/0"], false]);
  server.rows = [row(0), row(1, 3)];
  server.complete = false;
  feed.announce({ scan_id: SCAN, running: true, n_blocks: 2, next_block: 2 });
  await settled();
  expect(shown).toEqual(["0/0", "1/3"]);
});

test("a new scan replaces the old one", () => {
  const { feed, shown } = station([]);
  feed.announce({ scan_id: SCAN, running: true, n_blocks: 0, next_block: 0 });
  feed.receive(block(row(0)));
  feed.announce({ scan_id: OTHER, running: true, n_blocks: 0, next_block: 0 });
  expect(shown).toEqual(["other"]);
});

test("a finished scan is read to its end, page by page", async () => {
  const { feed, shown, server } = station(
    [0, 1, 2, 3, 4, 5, 6].map((number) => row(number)),
    true,
  );
  await feed.show(SCAN);
  expect(shown).toHaveLength(7);
  expect(feed.running).toBe(false);
  expect(server.n_asked).toBeLessThan(6);
});
