/** The images captured so far, with the detected points, and a button that deletes each. */

import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import { degrees, mm, px } from "../details/format";
import type { Change } from "./session_change";
import { SessionImage } from "./session_image";
import type { Session } from "./session_state";

/** An image is marked as an outlier if its RMS exceeds that of the session by this factor. */
const OUTLIER_RATIO = 2.5;

export function PosesView({ session, change }: { session: Session; change: Change }) {
  const words = text.value.calibration;
  const { poses, camera } = session.body;
  return (
    <section class="card stack poses">
      <h2>
        {words.images} <span class="muted number">({poses.length})</span>
      </h2>
      {poses.length === 0 && <p class="muted">{words.images_none}</p>}
      {camera.focal_px != null && (
        <p class="number">{words.camera_so_far(px(camera.focal_px, 1), px(camera.rms_px))}</p>
      )}
      <ul class="pose-list">
        {poses.map((pose, idx) => (
          <Pose
            key={pose.id}
            session={session}
            pose={pose}
            number={idx + 1}
            is_outlier={(pose.board.rms_px ?? 0) > OUTLIER_RATIO * (camera.rms_px ?? Number.POSITIVE_INFINITY)}
            change={change}
          />
        ))}
      </ul>
    </section>
  );
}

interface PoseProperties {
  session: Session;
  pose: Schemas["SessionPoseDto"];
  number: number;
  is_outlier: boolean;
  change: Change;
}

function Pose({ session, pose, number, is_outlier, change }: PoseProperties) {
  const { api } = useApp();
  const words = text.value.calibration;
  const { board, laser } = pose;
  const remove = useMemo(
    () =>
      new Command(async () => {
        await change((if_match) => {
          const params = { path: { id: session.id, pose_id: pose.id }, header: { "If-Match": if_match } };
          return data(api.DELETE("/api/v1/calibration-sessions/{id}/poses/{pose_id}", { params }));
        });
      }),
    [api, session.id, pose.id, change],
  );
  const problem = board.problem ?? (is_outlier ? words.outlier : undefined);
  return (
    <li class="pose" data-pose={pose.id}>
      <SessionImage
        session={session}
        artifact={board.image.artifact}
        label={words.pose(number)}
        dots={board.corners.map(([, , u = 0, v = 0]) => [u, v, undefined] as const)}
      />
      <div class="row">
        <strong class="grow">{words.pose(number)}</strong>
        <span class="number">{px(board.rms_px)}</span>
      </div>
      <small class="muted number">
        {degrees(board.tilt_deg, 0)} · {mm(board.distance_mm, 0)} ·{" "}
        {words.lines_found(String(laser?.n_segments ?? 0))}
      </small>
      {problem && <small class="bad">⚠ {problem}</small>}
      {laser?.problem && <small class="bad">⚠ {laser.problem}</small>}
      <CommandButton command={remove}>{words.delete}</CommandButton>
    </li>
  );
}
