/** Below the plot: frame number, display rate, age, stage position, exposure, lost and skipped frames. */

import { useApp } from "../../../app";
import { language, text } from "../../../text";
import { count, decimal, duration } from "../../../units";
import type { LiveView } from "../live_view";

export function FrameFacts({ view }: { view: LiveView }) {
  const { station } = useApp();
  const values = view.values.value;
  const words = text.value.live;
  const chosen = language.value;
  if (!values) return null;
  const lost = Object.values(station.status.value?.frames.dropped ?? {}).reduce((sum, n) => sum + n, 0);
  const images = values.dropped.find(({ stream }) => stream === "image");
  const age = values.age_ms;
  return (
    <dl class="frame-facts number">
      <Fact of="frame" name={words.frame}>
        {count(values.sequence, chosen)}
        {view.frozen.value && <span class="tag">{words.frozen}</span>}
      </Fact>
      <Fact of="rate" name={words.rate}>
        {decimal(values.rate_hz, 1, chosen)} Hz
      </Fact>
      <Fact of="age" name={words.age}>
        {age === undefined ? "–" : age < 1000 ? `${decimal(age, 0, chosen)} ms` : duration(age / 1000, chosen)}
      </Fact>
      <Fact name={words.stage}>
        {decimal(values.position_mm, 3, chosen)} {station.unit.value}
      </Fact>
      <Fact name={words.exposure}>{decimal(values.exposure_us, 0, chosen)} µs</Fact>
      <Fact name={words.lost_at_station} hint={words.lost_at_station_hint}>
        {count(lost, chosen)}
      </Fact>
      <Fact of="not_shown" name={words.not_shown} hint={words.not_shown_hint}>
        {words.not_shown_by(
          count(images?.by_rate ?? 0, chosen),
          count(images?.too_slow ?? 0, chosen),
          count(values.skipped, chosen),
        )}
      </Fact>
    </dl>
  );
}

function Fact({
  of,
  name,
  hint,
  children,
}: {
  of?: string;
  name: string;
  hint?: string;
  children: preact.ComponentChildren;
}) {
  return (
    <div title={hint} data-fact={of}>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}
