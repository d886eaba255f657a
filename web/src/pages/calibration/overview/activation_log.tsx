import type { Schemas } from "../../../api/client";
import { actorName } from "../../../components/actor";
import { language, text } from "../../../text";
import { moment } from "../../../units";

/** Who made which calibration the active one, newest first. */
export function ActivationLog({ acts }: { acts: readonly Schemas["ActivationDto"][] }) {
  const words = text.value.calibration;
  return (
    <section class="card">
      <h2>{words.log}</h2>
      {acts.length === 0 ? (
        <p class="muted">{words.log_empty}</p>
      ) : (
        <div class="scroll-x">
          <table class="log">
            <thead>
              <tr>
                <th scope="col">{words.log_when}</th>
                <th scope="col">{words.log_who}</th>
                <th scope="col">{words.log_act}</th>
                <th scope="col">{words.log_to}</th>
                <th scope="col">{words.log_before}</th>
              </tr>
            </thead>
            <tbody>
              {acts.map((act) => (
                <tr key={act.seq} data-act={act.action}>
                  <td>{moment(act.at_ms, language.value)}</td>
                  <td>{actorName(act.actor)}</td>
                  <td>{words.acts[act.action] ?? act.action}</td>
                  <td class="mono">{act.calibration_id ?? words.none}</td>
                  <td class="mono">{act.previous_id ?? words.none}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </section>
  );
}
