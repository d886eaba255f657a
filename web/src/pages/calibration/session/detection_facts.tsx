/** The result of the newest detection, in a line of constant height. */

import { text } from "../../../text";
import { degrees, mm, px, share } from "../details/format";
import type { LiveBoard } from "./live_board";
import type { Session } from "./session_state";
import { isKnownPose, STILL_FOR_MS } from "./stillness";
import { pointsOf } from "./target";

interface Properties {
  board: LiveBoard;
  session: Session;
  capturing: boolean;
}

export function DetectionFacts({ board, session, capturing }: Properties) {
  const words = text.value.calibration;
  const detection = board.detection.value;
  const n_all = pointsOf(session.body.target);
  if (capturing) return <Status words={words.capturing} progress={undefined} />;
  if (!detection) return <Status words={words.searching} progress={undefined} />;
  if (detection.corners.length === 0)
    return <Status words={words.board_missing} detail={detection.problem ?? undefined} />;
  const known = isKnownPose(detection, session);
  const seen = words.board_seen(String(detection.corners.length), String(n_all));
  const advice = detection.problem ?? (known ? words.known_pose : words.hold_still);
  return (
    <div class="detection" data-corners={detection.corners.length} data-known={known}>
      <Status words={seen} detail={advice} progress={known ? undefined : board.still_ms.value / STILL_FOR_MS} />
      <dl class="facts inline">
        <dt>{words.tilt}</dt>
        <dd>{detection.tilt_deg == null ? words.after_three : degrees(detection.tilt_deg)}</dd>
        <dt>{words.distance}</dt>
        <dd>{detection.distance_mm == null ? "–" : mm(detection.distance_mm, 0)}</dd>
        <dt>{words.rms_of}</dt>
        <dd>{px(detection.rms_px)}</dd>
        <dt>{words.sharpness}</dt>
        <dd>{px(detection.corner_sigma_px)}</dd>
        <dt>{words.overexposed}</dt>
        <dd>{share(detection.saturated_fraction, 1)}</dd>
      </dl>
    </div>
  );
}

function Status(properties: { words: string; detail?: string | undefined; progress?: number | undefined }) {
  const { words, detail, progress } = properties;
  return (
    <div class="board-facts">
      <div>
        <strong>{words}</strong> {detail && <span class="muted">{detail}</span>}
      </div>
      {progress !== undefined && (
        <progress value={Math.min(1, progress)} max={1} aria-label={text.value.calibration.still} />
      )}
    </div>
  );
}
