/** What scans use now, how good it says it is, and the way back to what was before. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { actorName } from "../../parts/actor";
import { CommandButton } from "../../parts/command_button";
import { Dialog } from "../../parts/dialog";
import { NameField } from "../../parts/name_field";
import { Command } from "../../state/command";
import { language, text } from "../../text";
import { moment } from "../../units";
import type { CalibrationItem } from "./figures";
import { age, mm, px, share, um } from "./format";

interface Properties {
  active: Schemas["ActiveDto"];
  item: CalibrationItem | undefined;
  acts: readonly Schemas["ActivationDto"][];
  reload: () => Promise<void>;
}

export function ActiveCard({ active, item, acts, reload }: Properties) {
  const { station } = useApp();
  const words = text.value.calibration;
  const asking = useSignal(false);
  const hint = station.simulated.value === "twin" ? words.none_active_hint : words.none_active_hint_real;
  return (
    <section class="card stack live-data" data-active={active.calibration_id ?? "none"}>
      <h2>{words.active}</h2>
      {item ? (
        <>
          <div class="row">
            <span class="big number">{um(item.summary.systematic_sigma_mm)}</span>
            <span class="muted">{words.depth_sigma}</span>
          </div>
          <Facts item={item} />
          <p class="muted">
            {active.actor && words.by(actorName(active.actor))}, {moment(active.at_ms, language.value)}
          </p>
        </>
      ) : (
        <div>
          <strong>{words.none_active}</strong>
          <p>{hint}</p>
        </div>
      )}
      <div class="row">
        {item?.report && (
          <a class="button" href={item.report} target="_blank" rel="noopener">
            {words.report}
          </a>
        )}
        <span class="command">
          <button
            type="button"
            aria-disabled={acts.length === 0 ? "true" : undefined}
            onClick={() => {
              asking.value = acts.length > 0;
            }}
          >
            {words.roll_back}
          </button>
          {acts.length === 0 && <small class="why">{words.roll_back_blocked}</small>}
        </span>
      </div>
      {asking.value && (
        <RollBack previous_id={lastStanding(acts)} reload={reload} onClose={() => (asking.value = false)} />
      )}
    </section>
  );
}

/** Figures of a calibration in a few lines. */
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
    </dl>
  );
}

/** What would be active after a roll-back: every roll-back cancels the activation before it that still stands. */
export function lastStanding(acts: readonly Schemas["ActivationDto"][]): string | undefined {
  let rolled_back = 0;
  for (const act of acts) {
    if (act.act === "roll_back") rolled_back += 1;
    else if (rolled_back === 0) return act.previous_id ?? undefined;
    else rolled_back -= 1;
  }
  return undefined;
}

function RollBack(properties: {
  previous_id: string | undefined;
  reload: () => Promise<void>;
  onClose: () => void;
}) {
  const { previous_id, reload, onClose } = properties;
  const { api } = useApp();
  const words = text.value.calibration;
  const roll_back = useMemo(
    () =>
      new Command(async () => {
        await data(api.POST("/api/v1/calibrations/active/roll-back"));
        await reload();
        onClose();
      }),
    [api, reload, onClose],
  );
  return (
    <Dialog title={words.roll_back_title} onClose={onClose}>
      <p>{previous_id ? words.roll_back_question(previous_id) : words.roll_back_question_none}</p>
      <NameField />
      <div class="row">
        <CommandButton command={roll_back} kind="primary">
          {words.roll_back_yes}
        </CommandButton>
        <button type="button" onClick={onClose}>
          {text.value.parts.cancel}
        </button>
      </div>
    </Dialog>
  );
}
