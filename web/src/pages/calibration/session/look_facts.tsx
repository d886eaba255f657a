/** What the newest look at the board says, in one line that does not jump. */

import { text } from "../../../text";
import { degrees, mm, px, share } from "../details/format";
import type { LiveBoard } from "./live_board";
import type { Session } from "./session_state";
import { isKnownPlace, STILL_FOR_MS } from "./stillness";
import { pointsOf } from "./target";

interface Properties {
  board: LiveBoard;
  session: Session;
  taking: boolean;
}

export function LookFacts({ board, session, taking }: Properties) {
  const words = text.value.calibration;
  const look = board.look.value;
  const n_all = pointsOf(session.body.target);
  if (taking) return <Status words={words.taking} progress={undefined} />;
  if (!look) return <Status words={words.looking} progress={undefined} />;
  if (look.corners.length === 0) return <Status words={words.board_missing} detail={look.problem ?? undefined} />;
  const known = isKnownPlace(look, session);
  const seen = words.board_seen(String(look.corners.length), String(n_all));
  const advice = look.problem ?? (known ? words.known_pose : words.hold_still);
  return (
    <div class="look" data-corners={look.corners.length} data-known={known}>
      <Status words={seen} detail={advice} progress={known ? undefined : board.still_ms.value / STILL_FOR_MS} />
      <dl class="facts inline">
        <dt>{words.tilt}</dt>
        <dd>{look.tilt_deg == null ? words.after_three : degrees(look.tilt_deg)}</dd>
        <dt>{words.distance}</dt>
        <dd>{look.distance_mm == null ? "–" : mm(look.distance_mm, 0)}</dd>
        <dt>{words.rms_of}</dt>
        <dd>{px(look.rms_px)}</dd>
        <dt>{words.sharpness}</dt>
        <dd>{px(look.corner_sigma_px)}</dd>
        <dt>{words.overexposed}</dt>
        <dd>{share(look.saturated_share, 1)}</dd>
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
