/** The main values of a calibration. */

import { text } from "../../../text";
import { age, correction_text, mm, px, share } from "./format";
import type { CalibrationItem } from "./summary";

export function Facts({ item }: { item: CalibrationItem }) {
  const words = text.value.calibration;
  const summary = item.summary;
  const counts = [summary.n_poses, summary.n_laser_poses, summary.n_stage_views].map(String);
  return (
    <dl class="facts">
      <dt>{words.id}</dt>
      <dd class="mono">{item.id}</dd>
      <dt>{words.age}</dt>
      <dd>{age(item.created_at_ms, Date.now())}</dd>
      <dt>{words.model}</dt>
      <dd>{summary.model ? words.model_names[summary.model] : "–"}</dd>
      <dt>{words.camera_rms}</dt>
      <dd>{px(summary.corner_rms_px)}</dd>
      <dt>{words.light_rms}</dt>
      <dd>{px(summary.light_rms_px)}</dd>
      <dt>{words.depth_range}</dt>
      <dd>
        {mm(summary.depth_near_mm, 0)} … {mm(summary.depth_far_mm, 0)}
      </dd>
      <dt>{words.scale}</dt>
      <dd>{summary.stage ? share(summary.stage.scale_error) : "–"}</dd>
      <dt>{words.poses}</dt>
      <dd>{words.poses_of(counts[0] ?? "", counts[1] ?? "", counts[2] ?? "")}</dd>
      <dt>{words.dark_frame}</dt>
      <dd>{correction_text(summary.correction)}</dd>
    </dl>
  );
}
