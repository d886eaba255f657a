/** Loads pages of blocks over HTTP. */

import { bytes } from "../../api/client";
import type { PointsPage } from "./block_feed";

export async function fetchPoints(scan_id: string, from_block: number): Promise<PointsPage> {
  const response = await bytes(`/api/v1/scans/${encodeURIComponent(scan_id)}/points?from_block=${from_block}`);
  return {
    buffer: await response.arrayBuffer(),
    next_block: Number(response.headers.get("Sheaf-Next-Block")),
    complete: response.headers.get("Sheaf-Complete") === "true",
  };
}
