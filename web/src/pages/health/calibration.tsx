/** Cards about the active calibration and the consistency of the orders. */

import { data, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { useAutoReloaded } from "../../components/loading/auto_reloaded";
import { href } from "../../state/browser/route";
import { language, text } from "../../text";
import { orderName } from "../../theme";
import { count, dateTime, length } from "../../units";
import { Facts, HealthCard } from "./card";
import { ageDays, calibrationTone, pairDisagrees } from "./tone";

function useActive() {
  const { api } = useApp();
  return useAutoReloaded(
    async () => {
      const { items } = await data(api.GET("/api/v1/calibrations", { params: { query: { limit: 200 } } }));
      return items.find((item) => item.active);
    },
    (event) => event.kind.startsWith("calibration."),
  ).state;
}

export function CalibrationCard() {
  const loaded = useActive().value;
  const words = text.value.health;
  const active = loaded.value;
  const known = "value" in loaded;
  const summary = active?.summary;
  const days = active && ageDays(active.created_at_ms, Date.now());
  return (
    <HealthCard
      title={text.value.pages.calibration}
      tone={known ? calibrationTone(active?.created_at_ms, Date.now()) : "calm"}
      headline={days !== undefined ? words.calibration_age(days) : known ? words.not_calibrated : "…"}
      advice={active ? words.calibration_old : words.calibrate}
    >
      {active && (
        <Facts
          of={[
            [words.model, text.value.light_models[summary?.model ?? ""] ?? summary?.model ?? "–"],
            [words.depth_sigma, length(summary?.systematic_sigma_mm, language.value)],
            [words.created, dateTime(active.created_at_ms, language.value)],
          ]}
        />
      )}
      <a href={href("calibration", undefined, active && { show: active.id })}>{text.value.pages.calibration}</a>
    </HealthCard>
  );
}

export function OrdersCard() {
  const { api } = useApp();
  const words = text.value.health;
  const active = useActive().value.value;
  const sigma_mm = active?.summary.systematic_sigma_mm;
  const scan = useAutoReloaded(
    async () => (await data(api.GET("/api/v1/scans", { params: { query: { limit: 1 } } }))).items[0],
    (event) => event.kind.startsWith("scan."),
  ).state.value.value;
  const pairs = scan?.report.self_consistency ?? [];
  if (!scan || pairs.length === 0) return null;
  const disagree = pairs.some((pair) => pairDisagrees(pair, sigma_mm));
  return (
    <HealthCard
      title={words.orders}
      tone={disagree ? "caution" : "calm"}
      headline={disagree ? words.orders_disagree : words.orders_agree}
      advice={words.orders_advice}
    >
      <p class="muted">
        {words.orders_of} <a href={href("result", scan.id)}>{scan.name}</a>
      </p>
      <table>
        <thead>
          <tr>
            <th>{words.pair}</th>
            <th class="number">{words.bias}</th>
            <th class="number">{words.rms}</th>
            <th class="number">{words.points}</th>
          </tr>
        </thead>
        <tbody>
          {pairs.map((pair) => (
            <Pair key={`${pair.order_a},${pair.order_b}`} pair={pair} bad={pairDisagrees(pair, sigma_mm)} />
          ))}
        </tbody>
      </table>
    </HealthCard>
  );
}

function Pair({ pair, bad }: { pair: Schemas["OrderPairDto"]; bad: boolean }) {
  return (
    <tr>
      <td>
        {bad && <strong>! </strong>}
        {orderName(pair.order_a)} / {orderName(pair.order_b)}
      </td>
      <td class="number">{length(pair.bias_mm, language.value)}</td>
      <td class="number">{length(pair.rms_mm, language.value)}</td>
      <td class="number">{count(pair.n_pairs, language.value)}</td>
    </tr>
  );
}
