/** The list of results. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data } from "../../api/client";
import { useApp } from "../../app";
import { DeleteDialog } from "../../components/dialogs/delete_dialog";
import { href } from "../../state/browser/route";
import { CLOUD_FORMATS } from "../../state/choices";
import { decidingCharacteristic, OUTCOME_SYMBOL, outcomeOf } from "../../state/records/outcome";
import type { Scan, ScannedPart } from "../../state/records/scanned";
import { Command } from "../../state/station/command";
import { language, text } from "../../text";
import { dateTime, decimal, length } from "../../units";

export function Rows({ parts }: { parts: readonly ScannedPart[] }) {
  const words = text.value.results;
  const deleting = useSignal<Scan | undefined>(undefined);
  return (
    <section class="card" aria-label={words.title}>
      <table class="wide results-table">
        <thead>
          <tr>
            <th>{words.part}</th>
            <th>{words.verdict}</th>
            <th class="number">{words.value}</th>
            <th>{words.when}</th>
            <th>{words.calibration}</th>
            <th>{words.download}</th>
            <th>
              <span class="visually-hidden">{words.delete}</span>
            </th>
          </tr>
        </thead>
        <tbody>
          {parts.map((part) => (
            <Row key={part.scan.id} part={part} onDelete={() => (deleting.value = part.scan)} />
          ))}
        </tbody>
      </table>
      {deleting.value && <Delete scan={deleting.value} onClose={() => (deleting.value = undefined)} />}
    </section>
  );
}

function Row({ part, onDelete }: { part: ScannedPart; onDelete: () => void }) {
  const words = text.value.results;
  const { scan } = part;
  const outcome = outcomeOf(part);
  const bad = outcome === "not_ok" || outcome === "invalid";
  return (
    <tr data-outcome={outcome}>
      <td>
        <a class="name" href={href("result", scan.id)}>
          {scan.name}
        </a>
        {scan.purpose === "verification" && <div class="tag">{words.verification}</div>}
        {scan.recomputed_from && <div class="muted">{words.recomputed}</div>}
      </td>
      <td data-label={words.verdict}>
        <span class={bad ? "tag bad" : "tag"}>
          <span aria-hidden="true">{OUTCOME_SYMBOL[outcome]}</span> {text.value.outcomes[outcome]}
        </span>
      </td>
      <td class="number" data-label={words.value}>
        <Value part={part} />
      </td>
      <td class="nowrap" data-label={words.when}>
        {dateTime(scan.created_at_ms, language.value)}
      </td>
      <td data-label={words.calibration}>
        <a class="mono" href={href("calibration", undefined, { show: scan.calibration_id })}>
          {scan.calibration_id.slice(0, 8)}
        </a>
      </td>
      <td data-label={words.download}>
        <span class="downloads">
          {scan.cloud
            ? CLOUD_FORMATS.map((format) => (
                <a key={format} href={`${scan.cloud}?format=${format}`} download={`${scan.name}.${format}`}>
                  {format.toUpperCase()}
                </a>
              ))
            : words.no_points}
        </span>
      </td>
      <td>
        <button type="button" class="quiet" onClick={onDelete} aria-label={words.delete_named(scan.name)}>
          {words.delete}
        </button>
      </td>
    </tr>
  );
}

function Value({ part }: { part: ScannedPart }) {
  const measured = decidingCharacteristic(part);
  if (!measured) return <>–</>;
  const { unit, expanded_uncertainty: u, value } = measured;
  return (
    <>
      {value === undefined ? "–" : `${decimal(value, 3, language.value)} ${unit}`}
      <div class="muted">
        {text.value.measured_as[measured.tool] ?? measured.tool}, U{" "}
        {unit === "mm" ? length(u, language.value) : `${decimal(u, 3, language.value)} °`}
      </div>
    </>
  );
}

function Delete({ scan, onClose }: { scan: Scan; onClose: () => void }) {
  const { api } = useApp();
  const words = text.value.results;
  const remove = useMemo(
    () =>
      new Command(async () => {
        await data(api.DELETE("/api/v1/scans/{id}", { params: { path: { id: scan.id } } }));
        onClose();
      }),
    [api, scan.id, onClose],
  );
  const question = words.delete_question(scan.name, dateTime(scan.created_at_ms, language.value));
  return <DeleteDialog title={words.delete_title} question={question} remove={remove} onClose={onClose} />;
}
