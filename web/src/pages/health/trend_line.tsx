/** A sparkline: values with their uncertainty around zero. */

import type { TrendValue } from "./watch_trend";

const WIDTH = 220;
const HEIGHT = 36;
const MARGIN = 4;

export function TrendLine({ points, label }: { points: readonly TrendValue[]; label: string }) {
  if (points.length === 0) return <span class="muted">–</span>;
  const range = Math.max(...points.map(({ value, u }) => Math.abs(value) + u)) || 1;
  const y = (value: number) => HEIGHT / 2 - (value / range) * (HEIGHT / 2 - MARGIN);
  const x = (at: number) => MARGIN + ((at + 0.5) / points.length) * (WIDTH - 2 * MARGIN);
  return (
    <svg
      class="trend-line"
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      width={WIDTH}
      height={HEIGHT}
      role="img"
      aria-label={label}
    >
      <line class="zero" x1={0} x2={WIDTH} y1={y(0)} y2={y(0)} />
      {points.map(({ value, u, bad }, at) => (
        <g key={at} class={bad ? "bad" : undefined}>
          <line x1={x(at)} x2={x(at)} y1={y(value - u)} y2={y(value + u)} />
          {bad ? (
            <path d={`M${x(at) - 3} ${y(value) - 3}l6 6m0 -6l-6 6`} />
          ) : (
            <circle cx={x(at)} cy={y(value)} r={2} />
          )}
        </g>
      ))}
    </svg>
  );
}
