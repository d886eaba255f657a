/** Cards about the service and its connection to this page. */

import type { Station } from "../../api/client";
import type { components } from "../../api/schema";
import { useApp } from "../../app";
import { href } from "../../state/browser/route";
import { language, text } from "../../text";
import { bytes, count, dateTime, decimal } from "../../units";
import { Facts, HealthCard } from "./card";
import { diskTone, framesTone, linkTone, queueTone } from "./tone";

export function FramesCard({ status }: { status: Station }) {
  const words = text.value.health;
  const { arrived, dropped } = status.frames;
  const lost = Object.values(dropped).reduce((sum, one) => sum + one, 0);
  const number = (value: number) => count(value, language.value);
  return (
    <HealthCard
      title={words.frames}
      tone={framesTone(status.frames)}
      headline={words.frames_count(number(arrived), number(lost))}
      advice={words.frames_advice}
    >
      <Facts
        of={Object.entries(dropped).map(([reason, lost]) => [
          text.value.drop_reasons[reason] ?? reason,
          number(lost),
        ])}
      />
    </HealthCard>
  );
}

export function LinkCard({ n_sockets }: { n_sockets: number | undefined }) {
  const { station, stream } = useApp();
  const words = text.value.health;
  const frame = text.value.frame;
  const round_trip_ms = stream.round_trip_ms.value;
  const dropped = stream.dropped.value;
  const number = (value: number | undefined) => count(value, language.value);
  return (
    <HealthCard
      title={words.link}
      tone={linkTone(station.stale.value, round_trip_ms, dropped)}
      headline={station.stale.value ? `${frame.link_stale} ${station.stale_s.value} s` : frame.link_live}
      advice={words.link_advice}
    >
      <Facts
        of={[
          [words.round_trip, `${decimal(round_trip_ms, 1, language.value)} ms`],
          [words.viewers, number(n_sockets)],
          ...dropped.map(
            ({ stream, offered, too_slow, by_rate }) =>
              [
                words.streams[stream] ?? stream,
                words.viewer_dropped(number(too_slow), number(by_rate), number(offered)),
              ] as const,
          ),
        ]}
      />
    </HealthCard>
  );
}

export function DiskCard({ metrics }: { metrics: ReadonlyMap<string, number> | undefined }) {
  const words = text.value.health;
  const free_bytes = metrics?.get("sheaf_store_free_bytes");
  const read_only = metrics?.get("sheaf_store_read_only") === 1;
  return (
    <HealthCard
      title={words.disk}
      tone={diskTone(free_bytes, read_only)}
      headline={read_only ? words.read_only : words.free(bytes(free_bytes, language.value))}
      advice={read_only ? words.read_only_advice : words.disk_advice}
    />
  );
}

export function QueueCard() {
  const { jobs } = useApp();
  const words = text.value.health;
  const open = jobs.open.value;
  const n_queued = open.filter((job) => job.state === "queued").length;
  return (
    <HealthCard
      title={words.queue}
      tone={queueTone(n_queued)}
      headline={words.queue_count(open.length - n_queued, n_queued)}
      advice={words.queue_advice}
    >
      <a href={href("jobs")}>{text.value.pages.jobs}</a>
    </HealthCard>
  );
}

/** State of the service from `GET /health`. */
export type ServiceHealth = components["schemas"]["HealthDto"];

export function SoftwareCard({ service }: { service: ServiceHealth | undefined }) {
  const { stream } = useApp();
  const words = text.value.health;
  const status = useApp().station.status.value;
  const since = status?.faults[0]?.since_ms;
  return (
    <HealthCard
      title={words.software}
      tone="calm"
      headline={`Sheaf ${service?.version ?? stream.server_version.value}`}
    >
      <Facts
        of={[
          [words.protocol, "sheaf.v1"],
          ...(service?.trusted_proxy ? [[words.access, words.trusted_proxy] as const] : []),
          ...(since ? [[words.fault_since, dateTime(since, language.value)] as const] : []),
        ]}
      />
      <a href="/docs/">{text.value.common.api_explorer}</a>
    </HealthCard>
  );
}
