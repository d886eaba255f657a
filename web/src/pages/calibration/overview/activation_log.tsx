import type { Schemas } from "../../../api/client";
import { actorName } from "../../../components/actor";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";

/** The log of activations and rollbacks, newest first. */
export function ActivationLog({ activations }: { activations: readonly Schemas["ActivationDto"][] }) {
  const words = text.value.calibration;
  return (
    <section class="card">
      <h2>{words.log}</h2>
      {activations.length === 0 ? (
        <p class="muted">{words.log_empty}</p>
      ) : (
        <div class="scroll-x">
          <table class="log">
            <thead>
              <tr>
                <th scope="col">{words.log_when}</th>
                <th scope="col">{words.log_who}</th>
                <th scope="col">{words.log_action}</th>
                <th scope="col">{words.log_to}</th>
                <th scope="col">{words.log_before}</th>
              </tr>
            </thead>
            <tbody>
              {activations.map((activation) => (
                <tr key={activation.seq} data-act={activation.action}>
                  <td>{dateTime(activation.at_ms, language.value)}</td>
                  <td>{actorName(activation.actor)}</td>
                  <td>{words.actions[activation.action] ?? activation.action}</td>
                  <td class="mono">{activation.calibration_id ?? words.none}</td>
                  <td class="mono">{activation.previous_id ?? words.none}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </section>
  );
}
