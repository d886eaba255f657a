/** Health: grey cards with cautions and alarms by exception, the event log, and the support bundle. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { bytes, data } from "../../api/client";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { href } from "../../state/browser/route";
import { Command } from "../../state/station/command";
import { text } from "../../text";
import { download, supportBundle } from "./bundle";
import { CalibrationCard, OrdersCard } from "./calibration";
import { Devices } from "./devices";
import { DoorsCard } from "./doors";
import { EventTable } from "./event_log";
import { parseMetrics } from "./metrics";
import { DiskCard, FramesCard, LinkCard, QueueCard, type ServiceHealth, SoftwareCard } from "./service";
import { WatchesCard } from "./watches";
import "./health.css";

/** Update interval of disk and connection metrics while the page is open. */
const REFRESH_EVERY_MS = 5000;

export default function Health() {
  const app = useApp();
  const words = text.value.health;
  const metrics = useSignal<ReadonlyMap<string, number> | undefined>(undefined);
  const service = useSignal<ServiceHealth | undefined>(undefined);
  useEffect(() => {
    const refresh = async () => {
      try {
        metrics.value = parseMetrics(await (await bytes("/metrics")).text());
        service.value = await data(app.api.GET("/health"));
      } catch {
        // The connection card shows that the server is not reachable.
      }
    };
    void refresh();
    const timer = setInterval(() => void refresh(), REFRESH_EVERY_MS);
    return () => clearInterval(timer);
  }, [app.api, metrics, service]);
  const bundle = useMemo(
    () =>
      new Command(async () => {
        const stamp = new Date().toISOString().slice(0, 19).replace(/[-:]/g, "");
        download(`sheaf-support-${stamp}.json`, await supportBundle(app));
      }),
    [app],
  );
  const status = app.station.status.value;
  return (
    <div class="stack health">
      <header class="row">
        <h1 class="grow">{words.title}</h1>
        <a class="button" href={href("studies")}>
          {text.value.studies.fitness_link}
        </a>
        <CommandButton command={bundle}>{words.bundle}</CommandButton>
      </header>
      <div class="cards">
        {status && <Devices status={status} />}
        {status && <FramesCard status={status} />}
        <LinkCard n_sockets={metrics.value?.get("sheaf_stream_sockets")} />
        <DiskCard metrics={metrics.value} />
        <QueueCard />
        <DoorsCard />
        <CalibrationCard />
        <SoftwareCard service={service.value} />
      </div>
      <WatchesCard />
      <OrdersCard />
      <EventTable />
      <p class="muted">{words.bundle_contents}</p>
    </div>
  );
}
