/** Shows who is in control, and opens the dialog to take or release control. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { useApp } from "../app";
import { CommandButton } from "../components/command_button";
import { Dialog } from "../components/dialogs/dialog";
import { NameField } from "../components/fields/name_field";
import { Command } from "../state/station/command";
import { text } from "../text";

export function ControlButton() {
  const { control, station } = useApp();
  const open = useSignal(false);
  const words = text.value.frame;
  // Without a connection the holder of control is unknown; a lease expires within seconds.
  const stale = station.stale.value;
  const other = stale ? undefined : control.other.value;
  const label = stale
    ? words.control_unknown
    : control.mine.value
      ? words.you_in_control
      : other
        ? words.other_in_control(other)
        : words.no_one_in_control;
  return (
    <>
      <button
        type="button"
        class="quiet control"
        aria-haspopup="dialog"
        onClick={() => {
          open.value = true;
        }}
      >
        {label}
        {other && ` – ${words.take_over}`}
      </button>
      {open.value && <ControlDialog onClose={() => (open.value = false)} />}
    </>
  );
}

function ControlDialog({ onClose }: { onClose: () => void }) {
  const { control } = useApp();
  const words = text.value.frame;
  const other = control.other.value;
  const take = useMemo(
    () =>
      new Command(async () => {
        await control.take(control.other.peek() !== undefined);
        onClose();
      }),
    [control, onClose],
  );
  const release = useMemo(
    () =>
      new Command(async () => {
        await control.release();
        onClose();
      }),
    [control, onClose],
  );
  return (
    <Dialog title={words.control} onClose={onClose}>
      <div class="stack">
        {other && <p>{words.take_over_question(other)}</p>}
        <NameField />
        <div class="row">
          {control.mine.value ? (
            <CommandButton command={release}>{words.release_control}</CommandButton>
          ) : (
            <CommandButton command={take} kind="primary">
              {other ? words.take_over : words.take_control}
            </CommandButton>
          )}
          <button type="button" onClick={onClose}>
            {text.value.common.close}
          </button>
        </div>
      </div>
    </Dialog>
  );
}
