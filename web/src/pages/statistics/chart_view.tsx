/** A control chart; the code that draws it is loaded on first use. */

import { useEffect, useRef } from "preact/hooks";
import { theme } from "../../state/browser/theme";
import { language, text } from "../../text";
import type { ChartData } from "./chart_data";
import type { ControlChartPlot } from "./control_chart";

interface Properties {
  data: ChartData;
  height_px: number;
  /** What the chart shows, for those who do not see it. */
  label: string;
  onPick: (idx: number) => void;
}

export function ChartView({ data, height_px, label, onPick }: Properties) {
  const place = useRef<HTMLDivElement>(null);
  const drawn = JSON.stringify([data, [...data.violated]]);
  const pick = useRef(onPick);
  pick.current = onPick;
  useEffect(() => {
    let chart: ControlChartPlot | undefined;
    let disposed = false;
    void import("./control_chart").then(({ ControlChartPlot }) => {
      if (disposed || !place.current) return;
      const names = text.value.statistics.lines;
      const options = { height_px, language: language.value, names, onPick: (idx: number) => pick.current(idx) };
      chart = new ControlChartPlot(place.current, data, options);
    });
    return () => {
      disposed = true;
      chart?.dispose();
    };
  }, [drawn, height_px, theme.value, language.value]);
  return <div class="chart" style={{ minHeight: `${height_px}px` }} ref={place} role="img" aria-label={label} />;
}
