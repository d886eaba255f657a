/** Results of the stage views on a turntable: the axis with its uncertainty. */

import { language, text } from "../../../text";
import { decimal } from "../../../units";
import type { AxisSummary } from "./summary";

export function AxisView({ axis }: { axis: AxisSummary }) {
  const words = text.value.calibration;
  const number = (value: number, digits: number) => decimal(value, digits, language.value);
  const vector = (of: readonly number[], digits: number) =>
    `(${of.map((value) => number(value, digits)).join("; ")})`;
  const um = (value: number | undefined) => `${number(value ?? Number.NaN, 1)} µm`;
  return (
    <section class="stack axis-summary">
      <dl class="facts">
        <dt>{words.axis_point}</dt>
        <dd>
          {vector(axis.point_mm, 3)} mm ± {vector(axis.shift_sigma_mm, 4)} mm
        </dd>
        <dt>{words.axis_direction}</dt>
        <dd>
          {vector(axis.direction, 6)} ± {vector(axis.tilt_sigma_deg, 4)}°
        </dd>
        <dt>{words.angle_sigma}</dt>
        <dd>{axis.angle_sigma_deg == null ? words.angle_sigma_unknown : `${number(axis.angle_sigma_deg, 4)}°`}</dd>
      </dl>
      <div class="scroll-x">
        <table>
          <thead>
            <tr>
              {[words.view_at_angle, words.tangential, words.radial, words.axial].map((name) => (
                <th scope="col" class="number" key={name}>
                  {name}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {axis.deviations_um.map(([angle_deg = 0, along, radial, height]) => (
              <tr key={angle_deg}>
                <td class="number">{number(angle_deg, 1)}°</td>
                <td class="number">{um(along)}</td>
                <td class="number">{um(radial)}</td>
                <td class="number">{um(height)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}
