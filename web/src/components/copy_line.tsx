/** A line of text with a button that copies it. */

import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { text } from "../text";

export function CopyLine({ line }: { line: string }) {
  const element = useRef<HTMLPreElement>(null);
  const copied = useSignal(false);
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(line);
      copied.value = true;
    } catch {
      // Without permission, or over plain HTTP from another computer, select the line instead.
      if (element.current) getSelection()?.selectAllChildren(element.current);
    }
  };
  return (
    <div class="copy-line">
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: a line that scrolls must be reachable by keyboard */}
      <pre ref={element} tabIndex={0}>
        {line}
      </pre>
      <button type="button" onClick={() => void copy()}>
        {copied.value ? text.value.common.copied : text.value.common.copy}
      </button>
    </div>
  );
}
