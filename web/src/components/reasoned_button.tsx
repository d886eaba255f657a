/** A button that says why it is blocked. */

interface Properties {
  label: string;
  title?: string;
  /** Why it cannot be pressed now. */
  blocked: string | false | undefined;
  onClick: () => void;
}

export function ReasonedButton({ label, title, blocked, onClick }: Properties) {
  // A blocked button stays focusable, so that its reason is accessible.
  return (
    <span class="command">
      <button
        type="button"
        aria-disabled={blocked ? "true" : undefined}
        title={blocked || title}
        onClick={() => !blocked && onClick()}
      >
        {label}
      </button>
      {blocked && <small class="why">{blocked}</small>}
    </span>
  );
}
