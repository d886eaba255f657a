/**
 * The three light models side by side, a recommendation in one sentence, and the angles compared with the grating
 * equation.
 */

import { language, text } from "../../../text";
import { orderName } from "../../../theme";
import { decimal } from "../../../units";
import { degrees, px, um } from "./format";
import { orderAngles, type Recommendation, recommendationOf } from "./light_models";
import type { CalibrationDocument, ModelScore, Summary } from "./summary";

export function ModelsView({ summary }: { summary: Summary }) {
  const words = text.value.calibration;
  const { models, model } = summary;
  if (!models) return <p class="muted">{words.no_light}</p>;
  return (
    <section class="stack models">
      <h3>{words.models}</h3>
      <p class="sentence">
        <strong>{recommendationText(recommendationOf(models))}</strong>
      </p>
      <div class="cards three">
        {models.scores.map((score) => (
          <ModelCard
            key={score.model}
            score={score}
            recommended={score.model === models.recommended}
            used={score.model === model}
          />
        ))}
      </div>
      <p class="muted">{words.models_lead}</p>
    </section>
  );
}

/** The recommendation as one sentence in the chosen language. */
export function recommendationText(recommendation: Recommendation): string {
  const words = text.value.calibration;
  const use = words.model_names[recommendation.use] ?? recommendation.use;
  switch (recommendation.kind) {
    case "curved":
      return words.recommendation_curved(use, um(recommendation.best_mm), um(recommendation.worst_mm));
    case "alike":
      return words.recommendation_alike(use, um(recommendation.best_mm));
    case "free":
      return words.recommendation_free(use, um(recommendation.best_mm), um(recommendation.worst_mm));
    case "unknown":
      return words.recommendation_unknown(use);
  }
}

function ModelCard({ score, recommended, used }: { score: ModelScore; recommended: boolean; used: boolean }) {
  const words = text.value.calibration;
  return (
    <div class={recommended ? "card model recommended" : "card model"} data-model={score.model}>
      <h4>
        {words.model_names[score.model]} {recommended && <span class="tag">{words.recommended}</span>}{" "}
        {used && <span class="tag">{words.used}</span>}
      </h4>
      <p class="muted">{words.model_is[score.model]}</p>
      {score.failure != null ? (
        <p>{words.not_fitted(score.failure)}</p>
      ) : (
        <>
          <div class="big number">{um(score.held_out_bias_mm)}</div>
          <div class="muted">{words.held_out_bias_big}</div>
          <dl class="facts">
            <dt>{words.held_out_depth}</dt>
            <dd>{um(score.held_out_rms_mm)}</dd>
            <dt>{words.held_out_px}</dt>
            <dd>{px(score.held_out_rms_px)}</dd>
            <dt>{words.fit_px}</dt>
            <dd>{px(score.fit_rms_px)}</dd>
          </dl>
        </>
      )}
    </div>
  );
}

/** Angles of the orders, and λ/d with its uncertainty. */
export function AnglesView({ document }: { document: CalibrationDocument }) {
  const words = text.value.calibration;
  const angles = orderAngles(document);
  if (angles.length === 0) return null;
  const ratio = document.report.light?.wavelength_over_period;
  return (
    <section class="stack angles">
      <h3>{words.angles}</h3>
      <div class="scroll-x">
        <table>
          <thead>
            <tr>
              <th scope="col">{words.order}</th>
              <th scope="col" class="number">
                {words.angle}
              </th>
              <th scope="col" class="number">
                {words.angle_nominal}
              </th>
              <th scope="col" class="number">
                {words.angle_difference}
              </th>
            </tr>
          </thead>
          <tbody>
            {angles.map(({ order, calibrated_deg, nominal_deg }) => (
              <tr key={order}>
                <th scope="row">{orderName(order)}</th>
                <td class="number">{degrees(calibrated_deg, 4)}</td>
                <td class="number">{degrees(nominal_deg, 4)}</td>
                <td class="number">
                  {nominal_deg === undefined ? "–" : degrees(calibrated_deg - nominal_deg, 4)}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {ratio && <p class="number">{words.ratio(...ratioText(ratio))}</p>}
      <p class="muted">{words.angles_lead}</p>
    </section>
  );
}

function ratioText(ratio: readonly number[]): [string, string, string] {
  const [value, sigma, nominal] = ratio.map((one) => decimal(one, 6, language.value));
  return [value ?? "", sigma ?? "", nominal ?? ""];
}
