/** Calibrations: what is active, how a new one is made, and which one to trust. */

import { route } from "../../state/route";
import { Overview } from "./overview";
import { Wizard } from "./wizard";
import "./calibration.css";

export default function Calibration() {
  const { id } = route.value;
  return id ? <Wizard key={id} id={id} /> : <Overview />;
}
