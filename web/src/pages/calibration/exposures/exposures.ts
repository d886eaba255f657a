/** The exposures of a calibration session: of the board, of the laser lines, and of the ambient light. */

import type { Schemas } from "../../../api/client";

export type Exposures = Schemas["ExposuresDto"];

/** Ambient light above which it is subtracted unless another limit was chosen, grey levels of 255. */
export const AMBIENT_LEVELS = 20;

/** Ambient light is subtracted above this limit, or never. */
export function withSubtraction(subtract: boolean, above_levels: number): Partial<Exposures> {
  return { background_above_levels: subtract ? above_levels : null };
}
