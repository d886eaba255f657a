/** Provenance of a result, downloads, and recomputation. */

import { data, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { CommandButton } from "../../components/command_button";
import { Choice, storedOption } from "../../components/fields/choice";
import { useLoaded } from "../../components/loading/loading";
import { href } from "../../state/browser/route";
import { CLOUD_FORMATS, MESH_FORMATS } from "../../state/choices";
import { language, text } from "../../text";
import { orderName } from "../../theme";
import { count, dateTime, decimal, length } from "../../units";
import type { ResultState } from "./result_state";
import type { Scan } from "./scan_record";

export function Provenance({ scan, n_shown }: { scan: Scan; n_shown: number }) {
  const words = text.value.result;
  const shown = language.value;
  const [report, plan] = [scan.report, scan.plan];
  const biases = (report.self_consistency ?? []).map((pair) => Math.abs(pair.bias_mm));
  return (
    <section class="card provenance" aria-label={words.provenance}>
      <h2>{words.provenance}</h2>
      <dl class="facts">
        <dt>{words.created}</dt>
        <dd>{dateTime(scan.created_at_ms, shown)}</dd>
        <dt>{words.calibration}</dt>
        <dd>
          <a class="mono" href={href("calibration", scan.calibration_id)}>
            {scan.calibration_id}
          </a>
          {" · "}
          <a href={`/api/v1/calibrations/${scan.calibration_id}/report`} target="_blank" rel="noreferrer">
            {words.report}
          </a>
        </dd>
        {plan.from_mm != null && (
          <>
            <dt>{words.travel}</dt>
            <dd>
              {decimal(plan.from_mm, 1, shown)} … {decimal(plan.to_mm, 1, shown)} mm, {length(plan.step_mm, shown)}
            </dd>
          </>
        )}
        {plan.from_deg != null && (
          <>
            <dt>{words.turn}</dt>
            <dd>
              {decimal(plan.from_deg, 1, shown)} … {decimal(plan.to_deg, 1, shown)}°,{" "}
              {decimal(plan.step_deg, 2, shown)}°
            </dd>
          </>
        )}
        {report.closure && (
          <>
            <dt>{words.closure}</dt>
            <dd>{closureOf(report.closure, shown)}</dd>
          </>
        )}
        {plan.exposure_us != null && (
          <>
            <dt>{words.exposure}</dt>
            <dd>{decimal(plan.exposure_us / 1000, 2, shown)} ms</dd>
          </>
        )}
        <dt>{words.frames}</dt>
        <dd>{count(report.n_frames, shown)}</dd>
        <dt>{words.n_points}</dt>
        <dd>
          {count(report.n_points, shown)}
          {n_shown > 0 && n_shown !== report.n_points && (
            <small class="muted"> {words.shown_of(count(n_shown, shown))}</small>
          )}
        </dd>
        <dt>{words.median_sigma}</dt>
        <dd>{length(report.median_sigma_mm, shown)}</dd>
        {biases.length > 0 && (
          <>
            <dt>{words.consistency}</dt>
            <dd>{length(Math.max(...biases), shown)}</dd>
          </>
        )}
        <dt>{words.software}</dt>
        <dd>sheaf {scan.software_version}</dd>
        <dt>{words.id}</dt>
        <dd class="mono">{scan.id}</dd>
        {scan.recomputed_from && (
          <>
            <dt>{words.recomputed_from}</dt>
            <dd>
              <a class="mono" href={href("result", scan.recomputed_from)}>
                {scan.recomputed_from}
              </a>
            </dd>
          </>
        )}
      </dl>
      <RejectedPoints scan={scan} />
    </section>
  );
}

/** RMS closure error after one revolution, for the same line and for other lines. */
function closureOf({ same_line, other_lines }: Schemas["ClosureDto"], shown: string): string {
  const words = text.value.result;
  const parts = [
    same_line && words.closure_same(length(same_line.rms_mm, shown)),
    other_lines && words.closure_other(length(other_lines.rms_mm, shown)),
  ];
  return parts.filter((part) => part).join(", ") || "–";
}

function RejectedPoints({ scan }: { scan: Scan }) {
  const words = text.value.result;
  const report = scan.report;
  if (!report.left_out || report.left_out.length === 0) return null;
  return (
    <details class="selected">
      <summary>{words.rejected_points}</summary>
      <dl class="facts">
        {report.left_out.map(({ reason, n_points }) => (
          <>
            <dt>{words.reasons[reason] ?? reason}</dt>
            <dd>
              {count(n_points, language.value)} {words.points}
            </dd>
          </>
        ))}
        {(report.self_consistency ?? []).map(({ order_a, order_b, bias_mm, rms_mm }) => (
          <>
            <dt>{words.between(orderName(order_a), orderName(order_b))}</dt>
            <dd>
              {length(bias_mm, language.value)}, RMS {length(rms_mm, language.value)}
            </dd>
          </>
        ))}
      </dl>
    </details>
  );
}

export function Downloads({ scan }: { scan: Scan }) {
  const words = text.value.result;
  const address = (what: string, format: string) => `/api/v1/scans/${scan.id}/${what}?format=${format}`;
  return (
    <section class="card downloads-card" aria-label={words.downloads}>
      <h2>{words.downloads}</h2>
      {!scan.cloud && <p class="muted">{words.blocked_no_cloud}</p>}
      {scan.cloud && (
        <dl class="downloads">
          <dt>{words.cloud}</dt>
          <dd class="row">
            {CLOUD_FORMATS.map((format) => (
              <a key={format} class="button" download href={address("cloud", format)}>
                {format.toUpperCase()}
              </a>
            ))}
          </dd>
          <dt>{words.mesh}</dt>
          <dd class="row">
            {MESH_FORMATS.map((format) => (
              <a key={format} class="button" download href={address("mesh", format)}>
                {format.toUpperCase()}
              </a>
            ))}
          </dd>
        </dl>
      )}
    </section>
  );
}

export function Recompute({ result }: { result: ResultState }) {
  const { api } = useApp();
  const words = text.value.result;
  const { state } = useLoaded(
    async () => (await data(api.GET("/api/v1/calibrations", { params: { query: { limit: 50 } } }))).items,
    [api],
  );
  return (
    <section class="card recompute" aria-label={words.recompute}>
      <h2>{words.recompute}</h2>
      <p class="muted">{words.recompute_hint}</p>
      <div class="stack">
        <Choice
          label={words.calibration}
          value={result.recalibration.value}
          options={[["", words.active_calibration], ...(state.value.value ?? []).map(storedOption)]}
          onChange={(id) => (result.recalibration.value = id)}
        />
        <CommandButton command={result.recompute}>{words.recompute_start}</CommandButton>
      </div>
    </section>
  );
}
