/** The active calibration with its uncertainty, and the rollback to the previous one. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../../api/client";
import { useApp } from "../../../app";
import { actorName } from "../../../components/actor";
import { CommandButton } from "../../../components/command_button";
import { Dialog } from "../../../components/dialogs/dialog";
import { NameField } from "../../../components/fields/name_field";
import { ReasonedButton } from "../../../components/reasoned_button";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { Facts } from "../details/facts";
import { um } from "../details/format";
import type { CalibrationItem } from "../details/summary";

interface Properties {
  active: Schemas["ActiveCalibrationDto"];
  item: CalibrationItem | undefined;
  activations: readonly Schemas["ActivationDto"][];
  reload: () => Promise<void>;
}

export function ActiveCard({ active, item, activations, reload }: Properties) {
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
            {active.actor && words.by(actorName(active.actor))}, {dateTime(active.at_ms, language.value)}
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
        <ReasonedButton
          label={words.roll_back}
          blocked={activations.length === 0 && words.roll_back_blocked}
          onClick={() => (asking.value = true)}
        />
      </div>
      {asking.value && (
        <RollBack
          previous_id={calibrationAfterRollBack(activations)}
          reload={reload}
          onClose={() => (asking.value = false)}
        />
      )}
    </section>
  );
}

/**
 * The calibration that is active after another rollback; each rollback cancels the latest activation not yet
 * cancelled.
 */
export function calibrationAfterRollBack(activations: readonly Schemas["ActivationDto"][]): string | undefined {
  let rolled_back = 0;
  for (const activation of activations) {
    if (activation.action === "roll_back") rolled_back += 1;
    else if (rolled_back === 0) return activation.previous_id ?? undefined;
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
          {text.value.common.cancel}
        </button>
      </div>
    </Dialog>
  );
}
