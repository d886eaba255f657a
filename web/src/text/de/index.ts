import type { Catalogue } from "../en";
import { calibration } from "./calibration";
import { frame, pages, parts } from "./frame";
import { health } from "./health";
import { help } from "./help";
import { jobs } from "./jobs";
import { live } from "./live";
import { operate } from "./operate";
import { result } from "./result";
import { results } from "./results";
import { scan } from "./scan";
import { settings } from "./settings";
import { viewer } from "./viewer";

/** Deutsch. */
export const de: Catalogue = {
  frame,
  pages,
  parts,
  calibration,
  health,
  help,
  jobs,
  live,
  operate,
  result,
  results,
  scan,
  settings,
  viewer,
};
