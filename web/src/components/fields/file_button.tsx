/** A button that opens a file. */

import { useId } from "preact/hooks";

interface Properties {
  label: string;
  /** Permitted endings of its name, separated by commas. */
  accept: string;
  disabled?: boolean;
  onFile: (file: File) => void;
}

export function FileButton({ label, accept, disabled = false, onFile }: Properties) {
  const id = useId();
  return (
    <div class="file-button">
      <label class="button" for={id}>
        {label}
      </label>
      <input
        id={id}
        type="file"
        class="visually-hidden"
        accept={accept}
        disabled={disabled}
        onChange={(event) => {
          const file = event.currentTarget.files?.[0];
          // Reset, so that the same file can be selected again after it was corrected.
          event.currentTarget.value = "";
          if (file) onFile(file);
        }}
      />
    </div>
  );
}
