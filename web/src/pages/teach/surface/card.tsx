/** A surface profile: the CAD model, how it is aligned, and the width of the zone. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { useApp } from "../../../app";
import { Check } from "../../../components/fields/check";
import { Choice } from "../../../components/fields/choice";
import { FileButton } from "../../../components/fields/file_button";
import { type Form, useForm } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import { ProblemCard } from "../../../components/problem";
import { ReasonedButton } from "../../../components/reasoned_button";
import { language, text } from "../../../text";
import { count, decimal } from "../../../units";
import { IdField } from "../id_field";
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
      <Choice
        label={words.model}
        value={chosen?.id ?? ""}
        options={[["", words.choose], ...draft.models.value.map(({ id, name }) => [id, name] as const)]}
        onChange={(value) => draft.choose(draft.models.peek().find(({ id }) => id === value))}
      />
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
      <Check
        label={words.best_fit}
        checked={!aligned || draft.best_fit.value}
        disabled={!aligned}
        onChange={(checked) => (draft.best_fit.value = checked)}
      />
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
        <IdField id={draft.id} />
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
