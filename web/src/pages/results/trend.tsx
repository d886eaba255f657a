/** The trend of one characteristic; the code of the chart is loaded on first use. */

import { useSignal } from "@preact/signals";
import { useEffect, useId, useMemo, useRef } from "preact/hooks";
import { goTo } from "../../state/browser/route";
import { theme } from "../../state/browser/theme";
import type { ScannedPart } from "../../state/records/scanned";
import { language, text } from "../../text";
import { decimal } from "../../units";
import type { TrendChart } from "./trend_chart";
import { characteristicsOf, trendOf } from "./trend_data";

export function TrendCard({ parts }: { parts: readonly ScannedPart[] }) {
  const words = text.value.results;
  const id = useId();
  const chosen = useSignal("");
  const place = useRef<HTMLDivElement>(null);
  const known = characteristicsOf(parts);
  const shown = known.includes(chosen.value) ? chosen.value : known[0];
  const trend = useMemo(() => (shown ? trendOf(parts, shown) : undefined), [parts, shown]);
  const drawn = JSON.stringify(trend);
  useEffect(() => {
    let chart: TrendChart | undefined;
    let disposed = false;
    void import("./trend_chart").then(({ TrendChart }) => {
      if (disposed || !place.current || !trend) return;
      chart = new TrendChart(place.current, trend, language.value, (point) => goTo("result", point.scan_id));
    });
    return () => {
      disposed = true;
      chart?.dispose();
    };
  }, [drawn, theme.value, language.value]);
  if (!shown || !trend || trend.points.length === 0) return null;
  const values = trend.points.map((point) => point.value);
  const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
  const range = Math.max(...values) - Math.min(...values);
  const written = (value: number) => `${decimal(value, 3, language.value)} ${trend.unit}`;
  const summary = words.trend_summary(values.length, written(mean), written(range));
  return (
    <section class="card" aria-label={words.trend}>
      <div class="row">
        <h2>{words.trend}</h2>
        <label class="visually-hidden" for={id}>
          {words.characteristic}
        </label>
        <select id={id} value={shown} onChange={(event) => (chosen.value = event.currentTarget.value)}>
          {known.map((one) => (
            <option key={one} value={one}>
              {labelOf(one)} ({one.split("/")[0] === "angle" ? "°" : "mm"})
            </option>
          ))}
        </select>
        <span class="muted number">{summary}</span>
      </div>
      <div class="trend" ref={place} role="img" aria-label={`${labelOf(shown)}: ${summary}`} />
      <p class="muted">{trend.tolerance === undefined ? words.trend_without_limits : words.trend_legend}</p>
    </section>
  );
}

function labelOf(characteristic: string): string {
  const [tool = "", ...name] = characteristic.split("/");
  const what = text.value.measured_as[tool] ?? tool;
  return name.length === 0 ? what : `${what} “${name.join("/")}”`;
}
