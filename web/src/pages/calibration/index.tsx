/** The calibration page: the overview, or the wizard of one session. */

import { route } from "../../state/browser/route";
import { Overview } from "./overview/overview";
import { Wizard } from "./steps/wizard";
import "./calibration.css";

export default function Calibration() {
  const { id } = route.value;
  return id ? <Wizard key={id} id={id} /> : <Overview />;
}
