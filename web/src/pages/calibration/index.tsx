/** Calibrations: what is active, how a new one is made, and which one to trust. */

import { route } from "../../state/browser/route";
import { Overview } from "./overview/overview";
import { Wizard } from "./steps/wizard";
import "./calibration.css";

export default function Calibration() {
  const { id } = route.value;
  return id ? <Wizard key={id} id={id} /> : <Overview />;
}
