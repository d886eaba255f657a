/** Whether events reach the other systems; nothing where no door is configured. */

import { useDoors } from "../../components/loading/doors";
import { href } from "../../state/browser/route";
import type { Door } from "../../state/records/doors";
import { language, text } from "../../text";
import { count } from "../../units";
import { HealthCard } from "./card";
import { doorTone, worstTone } from "./tone";

export function DoorsCard() {
  const doors = useDoors().state.value.value ?? [];
  const words = text.value.doors;
  if (doors.length === 0) return null;
  const abnormal = doors.filter((door) => doorTone(door) !== "calm");
  const { all_deliver, some_do_not } = words.health;
  return (
    <HealthCard
      title={words.title}
      tone={worstTone(doors.map(doorTone))}
      headline={abnormal.length === 0 ? all_deliver(doors.length) : some_do_not(abnormal.length, doors.length)}
      advice={adviceOn(abnormal)}
    >
      {abnormal.map((door) => (
        <Finding key={door.name} door={door} />
      ))}
      <a href={href("settings", "doors")}>{text.value.pages.settings}</a>
    </HealthCard>
  );
}

function Finding({ door }: { door: Door }) {
  const words = text.value.doors;
  const findings = [
    ...(door.state === "delivering" ? [] : [words.states[door.state]]),
    ...(door.n_dead > 0 ? [words.health.n_dead(count(door.n_dead, language.value))] : []),
  ];
  return (
    <p class="about" data-door={door.name}>
      <strong>{door.name}</strong>: {findings.join(", ")}
      {door.reason != null && (
        <small class="own-words" lang="en">
          {door.reason}
        </small>
      )}
    </p>
  );
}

/** What to do about the most urgent finding. */
function adviceOn(abnormal: readonly Door[]): string | undefined {
  const words = text.value.doors.health;
  if (abnormal.some(({ state }) => state === "closed")) return words.closed;
  if (abnormal.some(({ state }) => state === "waiting")) return words.waiting;
  return abnormal.length > 0 ? words.dead : undefined;
}
