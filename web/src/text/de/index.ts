import type { Catalogue } from "../en";
import { calibration } from "./calibration";
import { compare } from "./compare";
import { damaged } from "./damaged";
import { dark_frame } from "./dark_frame";
import { doors } from "./doors";
import { common, frame, pages } from "./frame";
import { health } from "./health";
import { help } from "./help";
import { inspections } from "./inspections";
import { jobs } from "./jobs";
import { live } from "./live";
import { drop_reasons, light_models, measured_as, outcomes, scene_on_stage, scenes, tools } from "./measuring";
import { operate } from "./operate";
import { problems } from "./problems";
import { recipe_settings } from "./recipe_settings";
import { result } from "./result";
import { results } from "./results";
import { scan } from "./scan";
import { settings } from "./settings";
import { statistics } from "./statistics";
import { studies } from "./studies";
import { surface } from "./surface";
import { teach } from "./teach";
import { viewer } from "./viewer";

/** German texts. */
export const de: Catalogue = {
  frame,
  pages,
  common,
  tools,
  measured_as,
  outcomes,
  light_models,
  scenes,
  scene_on_stage,
  drop_reasons,
  calibration,
  compare,
  damaged,
  dark_frame,
  doors,
  health,
  help,
  inspections,
  jobs,
  live,
  operate,
  problems,
  recipe_settings,
  result,
  results,
  scan,
  settings,
  statistics,
  studies,
  surface,
  teach,
  viewer,
};
