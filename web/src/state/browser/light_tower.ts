/** Whether Operate shows verdicts in the colours of a light tower, for halls where people look from afar. */

import { remembered } from "./remembered";

export const light_tower = remembered("light_tower", false);
