/** The button that activates a calibration, with confirmation. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { Dialog } from "../../../components/dialogs/dialog";
import { NameField } from "../../../components/fields/name_field";
import { useLoaded } from "../../../components/loading/loading";
import { Command } from "../../../state/station/command";
import { text } from "../../../text";
import type { CalibrationItem } from "../details/summary";

interface Properties {
  item: CalibrationItem;
  reload: () => Promise<void>;
  primary?: boolean;
}

export function ActivateButton({ item, reload, primary }: Properties) {
  const words = text.value.calibration;
  const asking = useSignal(false);
  const blocked = item.summary.model === null && words.camera_only;
  return (
    <>
      <button
        type="button"
        class={primary ? "primary" : undefined}
        title={blocked || undefined}
        aria-disabled={blocked ? "true" : undefined}
        onClick={() => {
          asking.value = !blocked;
        }}
      >
        {words.activate}
      </button>
      {asking.value && <Activate item={item} reload={reload} onClose={() => (asking.value = false)} />}
    </>
  );
}

function Activate({ item, reload, onClose }: Properties & { onClose: () => void }) {
  const { api } = useApp();
  const words = text.value.calibration;
  const { state } = useLoaded(async () => {
    const query = { calibration_id: item.id, purpose: "verification" as const, limit: 1 };
    return (await data(api.GET("/api/v1/scans", { params: { query } }))).items[0]?.verdict ?? undefined;
  }, [api, item.id]);
  const verdict = state.value.value;
  const bad = verdict === "ok" ? undefined : verdict;
  const activate = useMemo(
    () =>
      new Command(async () => {
        const body = { calibration_id: item.id, despite_verification: bad !== undefined };
        await data(api.PUT("/api/v1/calibrations/active", { body }));
        await reload();
        onClose();
      }),
    [api, item.id, bad, reload, onClose],
  );
  return (
    <Dialog title={words.activate_title} onClose={onClose}>
      <p>{words.activate_question(item.id)}</p>
      {bad && <p class="note bad">{words.activate_despite(text.value.outcomes[bad])}</p>}
      <NameField />
      <div class="row">
        <CommandButton command={activate} kind="primary">
          {bad ? words.activate_despite_yes : words.activate_yes}
        </CommandButton>
        <button type="button" onClick={onClose}>
          {text.value.common.cancel}
        </button>
      </div>
    </Dialog>
  );
}
