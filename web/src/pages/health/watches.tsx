/** Drift monitoring: the state of every watch, with its trend over the last scans. */

import { data, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { useAutoReloaded } from "../../components/loading/auto_reloaded";
import { href } from "../../state/browser/route";
import { language, text } from "../../text";
import { HealthCard } from "./card";
import { worstTone } from "./tone";
import { TrendLine } from "./trend_line";
import { latestOf, trendOf, type Verdict, valueText, WATCHES, type Watch, watchTone } from "./watch_trend";

export function WatchesCard() {
  const { api } = useApp();
  const words = text.value.health;
  const history = useAutoReloaded(
    () => data(api.GET("/api/v1/station/watches")),
    (event) => event.kind.startsWith("scan.") || event.kind === "watch.warned",
  ).state.value.value;
  const newest = history?.readings.at(-1);
  if (!history || !newest) return null;
  const tones = newest.verdicts.map((verdict) => watchTone(verdict.state));
  const tone = worstTone(tones);
  const { n_reference_scans: learned, n_reference_scans_needed: needed } = history;
  return (
    <HealthCard
      title={words.watches}
      tone={tone}
      headline={words.watch_headlines[tone]}
      advice={reasonOf(newest.verdicts.find((verdict) => watchTone(verdict.state) === tone))}
    >
      <p class="muted">
        {words.watches_of(history.readings.length)} <a href={href("result", newest.scan_id)}>{newest.scan_name}</a>
        {learned < needed && ` · ${words.reference_powers(learned, needed)}`}
      </p>
      <table class="watches">
        <thead>
          <tr>
            <th>{words.watch}</th>
            <th class="number">{words.value}</th>
            <th>{words.state}</th>
            <th>{words.trend}</th>
          </tr>
        </thead>
        <tbody>
          {WATCHES.map((watch) => (
            <WatchRow key={watch} watch={watch} history={history} />
          ))}
        </tbody>
      </table>
    </HealthCard>
  );
}

/** The reason in the language of the page; the server's message if there is no translation. */
function reasonOf(verdict: Verdict | undefined): string | undefined {
  const words = text.value.health;
  const translated = verdict?.reason_code && words.watch_reasons[verdict.reason_code];
  if (!translated) return verdict?.reason;
  return verdict.line == null ? translated : `${words.watch_line(verdict.line)}: ${translated}`;
}

function WatchRow({ watch, history }: { watch: Watch; history: Schemas["WatchHistoryDto"] }) {
  const words = text.value.health;
  const verdict = latestOf(history, watch);
  if (!verdict) return null;
  const trend = trendOf(history, watch);
  return (
    <tr>
      <td>{words.watch_names[watch]}</td>
      <td class="number">{valueText(verdict, language.value)}</td>
      <td title={reasonOf(verdict)}>
        {watchTone(verdict.state) !== "calm" && <strong>! </strong>}
        {words.watch_states[verdict.state]}
      </td>
      <td>
        <TrendLine points={trend} label={words.trend_of(words.watch_names[watch] ?? watch, trend.length)} />
      </td>
    </tr>
  );
}
