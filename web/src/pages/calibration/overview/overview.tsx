/** The page without a session: active calibration, new calibration, list of calibrations, activation log. */

import { useSignal } from "@preact/signals";
import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { DamagedRecords } from "../../../components/dialogs/damaged";
import { useAutoReloaded } from "../../../components/loading/auto_reloaded";
import { Show } from "../../../components/loading/loading";
import { route } from "../../../state/browser/route";
import { text } from "../../../text";
import { Comparison } from "../details/comparison";
import { Details } from "../details/details";
import { OpenSessions } from "../session/open_sessions";
import { NewSession } from "../steps/check_step";
import { ActivationLog } from "./activation_log";
import { ActiveCard } from "./active_card";
import { CalibrationList } from "./calibration_list";
import { NewCalibration } from "./new_calibration";

/** Number of calibrations and activations shown; older ones are available through the API. */
const SHOWN = 50;

export function Overview() {
  const { api } = useApp();
  const words = text.value.calibration;
  const query = { params: { query: { limit: SHOWN } } };
  const loaded = useAutoReloaded(async () => {
    const calibrations = await data(api.GET("/api/v1/calibrations", query));
    const active = await data(api.GET("/api/v1/calibrations/active"));
    const activations = await data(api.GET("/api/v1/calibrations/activations", query));
    const sessions = await data(api.GET("/api/v1/calibration-sessions", query));
    return {
      calibrations: calibrations.items,
      active,
      activations: activations.items,
      sessions: sessions.items,
      damaged: [calibrations, activations, sessions].flatMap((list) => list.damaged ?? []),
    };
  });
  const compared = useSignal<string | undefined>(undefined);
  const shown_id = route.value.query.get("show") ?? undefined;
  if (route.value.query.has("begin")) return <NewSession />;
  return (
    <>
      <header>
        <h1>{words.title}</h1>
      </header>
      <Show of={loaded.state}>
        {({ calibrations, active, activations, sessions, damaged }) => {
          const active_id = active.calibration_id ?? undefined;
          const item = calibrations.find((one) => one.id === active_id);
          return (
            <div class="stack calibration">
              <DamagedRecords rows={damaged} />
              <div class="cards two">
                <ActiveCard active={active} item={item} activations={activations} reload={loaded.reload} />
                <NewCalibration active_id={active_id} reload={loaded.reload} />
              </div>
              {sessions.length > 0 && <OpenSessions sessions={sessions} reload={loaded.reload} />}
              <CalibrationList
                items={calibrations}
                active_id={active_id}
                onCompare={(id) => {
                  compared.value = id;
                }}
                reload={loaded.reload}
              />
              {compared.value && active_id && (
                <Comparison
                  key={compared.value}
                  one={active_id}
                  other={compared.value}
                  onClose={() => {
                    compared.value = undefined;
                  }}
                />
              )}
              {shown_id && <Details key={shown_id} id={shown_id} />}
              <ActivationLog activations={activations} />
            </div>
          );
        }}
      </Show>
    </>
  );
}
