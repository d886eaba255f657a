/** A button that runs a command and shows its progress and result. */

import type { ComponentChildren } from "preact";
import { useRef } from "preact/hooks";
import type { Command } from "../state/station/command";
import { text } from "../text";
import { ProblemCard } from "./problem";

interface Properties {
  command: Command;
  children: ComponentChildren;
  /** Why the command is not possible now; shown below the button. */
  blocked?: string | false | undefined;
  kind?: "primary" | "danger" | "quiet" | "operator" | "primary operator" | undefined;
}

export function CommandButton({ command, children, blocked, kind }: Properties) {
  const phase = command.phase.value;
  const problem = command.problem.value;
  const busy = phase === "requested" || phase === "accepted";
  const words = text.value.common;
  const present = useRef({ blocked, command });
  present.current = { blocked, command };
  const press = () => {
    if (!present.current.blocked) void present.current.command.start();
  };
  // A blocked button stays focusable, so that its reason is accessible.
  return (
    <span class="command">
      <button
        type="button"
        class={kind}
        title={blocked || undefined}
        aria-disabled={blocked || busy ? "true" : undefined}
        data-phase={phase}
        onClick={() => {
          // In some browsers a touch does not blur a field: commit its input first.
          const field = document.activeElement;
          if (!(field instanceof HTMLInputElement && field.classList.contains("number-input"))) return press();
          field.blur();
          setTimeout(press);
        }}
      >
        {children}
        {busy && <small>{phase === "requested" ? words.requested : words.accepted}</small>}
      </button>
      {blocked && <small class="why">{blocked}</small>}
      {problem && <ProblemCard problem={problem} onDismiss={() => command.dismiss()} />}
    </span>
  );
}
