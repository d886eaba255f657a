/** The records that the page of a result shows. */

import type { Schemas } from "../../api/client";

export type Scan = Schemas["ScanDto"];
export type Measurement = Schemas["MeasurementDto"];
