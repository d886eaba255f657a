/** The doors section: all doors with their state, or how a door is configured. */

import { useEffect, useRef } from "preact/hooks";
import { CopyLine } from "../../../components/copy_line";
import { useDoors } from "../../../components/loading/doors";
import { ProblemCard } from "../../../components/problem";
import { route } from "../../../state/browser/route";
import { text } from "../../../text";
import { DoorCard } from "./door_card";
import { EXAMPLE } from "./door_facts";
import "./doors.css";

export function Doors() {
  const words = text.value.doors;
  const { state, reload } = useDoors();
  const section = useRef<HTMLElement>(null);
  const { value: doors, problem } = state.value;
  const wanted = route.value.id === "doors" && doors !== undefined;
  useEffect(() => {
    if (!wanted) return;
    section.current?.scrollIntoView();
    section.current?.focus({ preventScroll: true });
  }, [wanted]);
  return (
    <section ref={section} class="card stack doors" aria-label={words.title} tabIndex={-1}>
      <h2>{words.title}</h2>
      <p>{words.what}</p>
      {problem && <ProblemCard problem={problem} />}
      {!doors && !problem && <p class="muted">{text.value.frame.loading}</p>}
      {doors?.length === 0 && <Example />}
      {doors && doors.length > 0 && (
        <>
          <p class="muted">{words.configured_in}</p>
          <ul class="plain stack">
            {doors.map((door) => (
              <DoorCard key={door.name} door={door} reload={reload} />
            ))}
          </ul>
        </>
      )}
    </section>
  );
}

/** The empty state: an example configuration. */
function Example() {
  return (
    <>
      <p>{text.value.doors.none}</p>
      <CopyLine line={EXAMPLE} />
    </>
  );
}
