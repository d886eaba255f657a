import { text } from "../../text";

/** Reloads the page: after a server update or an error in the page. */
export function ReloadButton() {
  return (
    <button type="button" onClick={() => location.reload()}>
      {text.value.frame.reload}
    </button>
  );
}
