/** The records shown on the result page. */

import type { Schemas } from "../../api/client";

export type Scan = Schemas["ScanDto"];
export type Measurement = Schemas["MeasurementDto"];
