/** Confirmation before permanent deletion. */

import type { Command } from "../../state/station/command";
import { text } from "../../text";
import { CommandButton } from "../command_button";
import { Dialog } from "./dialog";

interface Properties {
  title: string;
  question: string;
  remove: Command;
  onClose: () => void;
}

export function DeleteDialog({ title, question, remove, onClose }: Properties) {
  return (
    <Dialog title={title} onClose={onClose}>
      <div class="stack">
        <p>{question}</p>
        <div class="row">
          <CommandButton command={remove} kind="danger">
            {text.value.results.delete_yes}
          </CommandButton>
          <button type="button" onClick={onClose}>
            {text.value.common.cancel}
          </button>
        </div>
      </div>
    </Dialog>
  );
}
