/** The data of one inspection as files. */

import { type Inspection, versionName } from "../../state/records/inspections";

/** Attributes of a link that downloads a file. */
export interface FileLink {
  href: string;
  /** Name of the file. */
  download: string;
}

type Identified = Pick<Inspection, "id" | "seq" | "serial" | "created_at_ms"> & {
  recipe: Pick<Inspection["recipe"], "id" | "version">;
};

export function dataFiles(inspection: Identified): Record<"json" | "csv" | "dfq", FileLink> {
  const { id, seq, serial } = inspection;
  const one = `/api/v1/inspections/${encodeURIComponent(id)}`;
  const name = `${serial}_${seq}`;
  return {
    json: { href: one, download: `${name}.json` },
    csv: { href: csvHref(inspection), download: `${name}.csv` },
    dfq: { href: `${one}/report?format=dfq`, download: `${name}.dfq` },
  };
}

/**
 * The export of the inspections of this part in the millisecond of its verdict: the API has CSV of selections only, and
 * a station gives no two verdicts on a part in a millisecond.
 */
function csvHref({ serial, recipe, created_at_ms }: Identified): string {
  const query = new URLSearchParams({
    format: "csv",
    serial,
    recipe: versionName(recipe),
    from_ms: `${created_at_ms}`,
    to_ms: `${created_at_ms + 1}`,
  });
  return `/api/v1/inspections/export?${query}`;
}
