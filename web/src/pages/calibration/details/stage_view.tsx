/** Results of the stage views: direction, scale, straightness and tilt of the travel. */

import { language, text } from "../../../text";
import { decimal } from "../../../units";
import { share } from "./format";
import { niceCeiling } from "./heat_map";
import type { StageSummary } from "./summary";

/** Okabe–Ito colours of the three deviations, always with a label. */
const DEVIATIONS = [
  { colour: "#56B4E9", words: "along" },
  { colour: "#E69F00", words: "across_1" },
  { colour: "#009E73", words: "across_2" },
] as const;

const [WIDTH, HEIGHT, LEFT, BOTTOM, RIGHT, TOP] = [640, 220, 64, 34, 12, 12];

export function StageView({ stage }: { stage: StageSummary }) {
  const words = text.value.calibration;
  const number = (value: number) => decimal(value, 6, language.value);
  // Adding 0 converts −0 to 0.
  const um = (value: number) => `${decimal(Math.round(10 * value) / 10 + 0, 1, language.value)} µm`;
  return (
    <section class="stack stage-summary">
      <dl class="facts">
        <dt>{words.scale}</dt>
        <dd>
          {share(stage.scale_error)} ± {share(stage.scale_sigma, 4)}
        </dd>
        <dt>{words.straightness}</dt>
        <dd>{um(stage.straightness_rms_um)} RMS</dd>
        {stage.tilt_sigma_urad && (
          <>
            <dt>{words.stage_tilt}</dt>
            <dd>{stage.tilt_sigma_urad.map((value) => decimal(value, 0, language.value)).join("; ")} µrad</dd>
          </>
        )}
        <dt>{words.stage_direction}</dt>
        <dd>({stage.direction.map(number).join("; ")})</dd>
      </dl>
      <h4>{words.straightness_map}</h4>
      <Chart stage={stage} />
      <ul class="plain row legend">
        {DEVIATIONS.map(({ colour, words: name }) => (
          <li key={name} class="row">
            <span class="swatch" style={{ background: colour }} />
            {words[name]}
          </li>
        ))}
      </ul>
      <div class="scroll-x">
        <table>
          <thead>
            <tr>
              <th scope="col" class="number">
                {words.view_at}
              </th>
              {DEVIATIONS.map(({ words: name }) => (
                <th scope="col" class="number" key={name}>
                  {words[name]}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {stage.straightness_um.map(([position_mm = 0, ...deviations_um]) => (
              <tr key={position_mm}>
                <td class="number">{decimal(position_mm, 1, language.value)} mm</td>
                {DEVIATIONS.map(({ words: name }, idx) => (
                  <td class="number" key={name}>
                    {um(deviations_um[idx] ?? 0)}
                  </td>
                ))}
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}

function Chart({ stage }: { stage: StageSummary }) {
  const words = text.value.calibration;
  const views = stage.straightness_um.map(([position_mm = 0, ...deviations_um]) => ({
    position_mm,
    deviations_um,
  }));
  const largest = Math.max(...views.flatMap((view) => view.deviations_um.map(Math.abs)), 0.1);
  const end_um = niceCeiling(largest);
  const positions = views.map((view) => view.position_mm);
  const [low, high] = [Math.min(...positions), Math.max(...positions)];
  const x = (position: number) =>
    LEFT + ((position - low) / Math.max(1e-9, high - low)) * (WIDTH - LEFT - RIGHT - 60) + 30;
  const y = (value_um: number) => TOP + (0.5 - value_um / (2 * end_um)) * (HEIGHT - TOP - BOTTOM);
  const label = words.straightness_label(`${decimal(stage.straightness_rms_um, 1, language.value)} µm`);
  return (
    <div class="data-view chart">
      <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label={label}>
        {[-end_um, 0, end_um].map((value) => (
          <g key={value}>
            <line x1={LEFT} x2={WIDTH - RIGHT} y1={y(value)} y2={y(value)} class={value === 0 ? "zero" : "rule"} />
            <text x={LEFT - 6} y={y(value) + 4} text-anchor="end">
              {decimal(value, end_um < 2 ? 1 : 0, language.value)} µm
            </text>
          </g>
        ))}
        {positions.map((position) => (
          <text key={position} x={x(position)} y={HEIGHT - 10} text-anchor="middle">
            {decimal(position, 0, language.value)} mm
          </text>
        ))}
        {DEVIATIONS.map(({ colour }, idx) => (
          <g key={colour}>
            <polyline
              points={views.map((view) => `${x(view.position_mm)},${y(view.deviations_um[idx] ?? 0)}`).join(" ")}
              fill="none"
              stroke={colour}
            />
            {views.map((view) => (
              <circle
                key={view.position_mm}
                cx={x(view.position_mm)}
                cy={y(view.deviations_um[idx] ?? 0)}
                r="3.5"
                fill={colour}
              />
            ))}
          </g>
        ))}
      </svg>
    </div>
  );
}
