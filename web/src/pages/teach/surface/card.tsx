/** A surface profile: the CAD model, how it is aligned, and the width of the zone. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { useApp } from "../../../app";
import { FileButton } from "../../../components/fields/file_button";
import { type Form, useForm } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { ProblemCard } from "../../../components/problem";
import { language, text } from "../../../text";
import { count, decimal } from "../../../units";
import type { TeachState } from "../teach_state";
import { SurfaceDraft } from "./draft";
import { hasVolume, type Model, POSE_ENTRIES, withEntry } from "./profile";
import { SurfaceRegion } from "./region";

export function SurfaceCard({ state }: { state: TeachState }) {
  const { api } = useApp();
  const words = text.value.surface;
  const draft = useMemo(() => new SurfaceDraft(api, state), [api, state]);
  return (
    <details
      class="card surface"
      onToggle={(event) => {
        if (event.currentTarget.open) void draft.load.start();
      }}
    >
      <summary>{words.card}</summary>
      <div class="stack">
        <p class="muted">{words.hint}</p>
        <ModelChoice draft={draft} />
        <Entries draft={draft} />
      </div>
    </details>
  );
}

function ModelChoice({ draft }: { draft: SurfaceDraft }) {
  const words = text.value.surface;
  const chosen = draft.model.value;
  const problem = draft.load.problem.value;
  return (
    <>
      <label class="field">
        <span>{words.model}</span>
        <select
          value={chosen?.id ?? ""}
          onChange={({ currentTarget: { value } }) =>
            draft.choose(draft.models.peek().find(({ id }) => id === value))
          }
        >
          <option value="">{words.choose}</option>
          {draft.models.value.map(({ id, name }) => (
            <option key={id} value={id}>
              {name}
            </option>
          ))}
        </select>
      </label>
      {problem && <ProblemCard problem={problem} onDismiss={() => draft.load.dismiss()} />}
      {chosen && <ModelFacts model={chosen} />}
      <Upload draft={draft} />
    </>
  );
}

function ModelFacts({ model: { summary, name } }: { model: Model }) {
  const words = text.value.surface;
  const { n_triangles, min_mm, max_mm, closed } = summary;
  const size = max_mm.map((high, axis) => decimal(high - (min_mm[axis] ?? 0), 1, language.value));
  return (
    <p class="muted" data-model={name}>
      {words.facts(count(n_triangles, language.value), size.join(" × "))}
      {!closed && ` ${words.open}`}
    </p>
  );
}

/** Uploads a file that was chosen or dropped here. */
function Upload({ draft }: { draft: SurfaceDraft }) {
  const words = text.value.surface;
  const over = useSignal(false);
  const { running, problem } = draft.upload;
  const send = (file: File | undefined) => file && void draft.upload.start(file);
  return (
    <>
      <fieldset
        class={over.value ? "drop over" : "drop"}
        aria-label={words.upload}
        onDragOver={(event) => {
          event.preventDefault();
          over.value = true;
        }}
        onDragLeave={() => (over.value = false)}
        onDrop={(event) => {
          event.preventDefault();
          over.value = false;
          send(event.dataTransfer?.files[0]);
        }}
      >
        <FileButton label={words.upload} accept=".stl,.glb,.ply" disabled={running} onFile={send} />
        <small class="muted" role="status">
          {running ? words.uploading : words.upload_hint}
        </small>
      </fieldset>
      {problem.value && <ProblemCard problem={problem.value} onDismiss={() => draft.upload.dismiss()} />}
    </>
  );
}

function Entries({ draft }: { draft: SurfaceDraft }) {
  const words = text.value.surface;
  const form = useForm();
  const aligned = draft.is_aligned.value;
  return (
    <>
      <label class="check">
        <input
          type="checkbox"
          checked={!aligned || draft.best_fit.value}
          disabled={!aligned}
          onChange={(event) => (draft.best_fit.value = event.currentTarget.checked)}
        />
        {words.best_fit}
      </label>
      <p class="muted">{aligned ? words.best_fit_hint : `${words.best_fit_needed} ${words.best_fit_hint}`}</p>
      {!aligned && <Pose draft={draft} form={form} />}
      <SurfaceRegion draft={draft} form={form} />
      <div class="row end">
        <NumberField
          form={form}
          label={words.reach}
          unit="mm"
          optional
          min={0.001}
          value={draft.reach_mm.value}
          onChange={(value) => (draft.reach_mm.value = value)}
        />
        <NumberField
          form={form}
          label={words.limit}
          unit="mm"
          optional
          min={0.001}
          value={draft.width_mm.value}
          onChange={(value) => (draft.width_mm.value = value)}
        />
        <Name draft={draft} />
      </div>
      <p class="muted">{words.reach_hint}</p>
      <Add draft={draft} form={form} />
    </>
  );
}

function Pose({ draft, form }: { draft: SurfaceDraft; form: Form }) {
  const words = text.value.surface;
  const blocked = draft.model.value ? undefined : words.choose;
  return (
    <fieldset class="stack pose" aria-label={words.start}>
      <span>{words.start}</span>
      <div class="row end">
        {POSE_ENTRIES.map(({ axis, unit }, idx) => (
          <NumberField
            key={`${axis}${unit}`}
            form={form}
            label={unit === "°" ? words.turn(axis) : axis}
            unit={unit}
            value={draft.start.value[idx]}
            onChange={(value) => {
              if (value !== undefined) draft.start.value = withEntry(draft.start.peek(), idx, value);
            }}
          />
        ))}
      </div>
      <ReasonedButton
        label={words.propose}
        title={words.propose_hint}
        blocked={blocked}
        onClick={() => draft.propose()}
      />
    </fieldset>
  );
}

function Name({ draft }: { draft: SurfaceDraft }) {
  return (
    <label class="field">
      <span>{text.value.teach.id}</span>
      <input
        value={draft.id.value}
        spellcheck={false}
        autoComplete="off"
        maxLength={60}
        onInput={(event) => {
          draft.id.value = event.currentTarget.value.trim();
        }}
      />
    </label>
  );
}

function Add({ draft, form }: { draft: SurfaceDraft; form: Form }) {
  const words = text.value.teach;
  const fault = draft.id_fault.value;
  const region = draft.region.value;
  const empty = region && !hasVolume(region) ? text.value.surface.region_empty : undefined;
  const blocked = draft.model.value
    ? (form.blocked.value ?? empty ?? (fault && words.id_faults[fault]))
    : text.value.surface.choose;
  return <ReasonedButton label={words.add} blocked={blocked} onClick={() => draft.add()} />;
}

interface ButtonProperties {
  label: string;
  title?: string;
  /** Why it cannot be pressed now. */
  blocked: string | undefined;
  onClick: () => void;
}

function ReasonedButton({ label, title, blocked, onClick }: ButtonProperties) {
  return (
    <span class="command">
      <button
        type="button"
        aria-disabled={blocked ? "true" : undefined}
        title={blocked ?? title}
        onClick={() => !blocked && onClick()}
      >
        {label}
      </button>
      {blocked && <small class="why">{blocked}</small>}
    </span>
  );
}
