/** The last attempts of a door, newest first. */

import type { Attempt } from "../../../state/records/doors";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { attemptName, number } from "./door_facts";

export function Attempts({ attempts }: { attempts: readonly Attempt[] }) {
  const words = text.value.doors;
  if (attempts.length === 0) return <p class="muted">{words.no_attempts}</p>;
  return (
    <details class="attempts">
      <summary>{words.attempts(number(attempts.length))}</summary>
      <table class="wide">
        <thead>
          <tr>
            <th>{words.when}</th>
            <th>{words.event}</th>
            <th>{words.result}</th>
          </tr>
        </thead>
        <tbody>
          {attempts.map((attempt) => (
            <Row key={`${attempt.at_ms} ${attempt.seq}`} attempt={attempt} />
          ))}
        </tbody>
      </table>
    </details>
  );
}

function Row({ attempt }: { attempt: Attempt }) {
  const words = text.value.doors;
  const { reason } = attempt;
  return (
    <tr data-attempt={reason == null ? "delivered" : "failed"}>
      <td class="nowrap">{dateTime(attempt.at_ms, language.value)}</td>
      <td data-label={words.event}>{attemptName(attempt)}</td>
      <td data-label={words.result}>
        {reason == null ? (
          words.success
        ) : (
          <>
            <span class="tag bad">✕ {words.failure}</span> <span lang="en">{reason}</span>
          </>
        )}
      </td>
    </tr>
  );
}
