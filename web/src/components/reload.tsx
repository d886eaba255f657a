import { text } from "../text";

/** Loads the page again: after an update of the server, or when a part of it failed. */
export function ReloadButton() {
  return (
    <button type="button" onClick={() => location.reload()}>
      {text.value.frame.reload}
    </button>
  );
}
