/** Selects an archive, uploads it with progress, and calibrates from it. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { type Problem, ProblemError } from "../../../api/client";
import { FileButton } from "../../../components/fields/file_button";
import { ProblemCard } from "../../../components/problem";
import { Command } from "../../../state/station/command";
import { language, text } from "../../../text";
import { bytes } from "../../../units";
import { archiveType, type Upload, upload } from "./upload";

interface Properties {
  /** Called when the server has checked and stored the capture; resolves when the calibration is done. */
  onUploaded: (capture_id: string, accepted: () => void) => Promise<void>;
}

interface Sending {
  upload: Upload;
  sent_bytes: number;
  size_bytes: number;
}

export function UploadButton({ onUploaded }: Properties) {
  const words = text.value.calibration;
  const sending = useSignal<Sending | undefined>(undefined);
  const send = useMemo(
    () =>
      new Command<[File]>(async (steps, file) => {
        const media_type = archiveType(file.name);
        if (!media_type) throw new ProblemError(wrongFileType());
        const running = upload(
          file,
          media_type,
          (sent_bytes) => {
            sending.value = { upload: running, sent_bytes, size_bytes: file.size };
          },
          broken(),
        );
        sending.value = { upload: running, sent_bytes: 0, size_bytes: file.size };
        try {
          const { id } = await running.done;
          sending.value = undefined;
          await onUploaded(id, () => steps.accepted());
        } finally {
          sending.value = undefined;
        }
      }),
    [],
  );
  const problem = send.problem.value;
  return (
    <div class="stack upload">
      <FileButton
        label={words.upload}
        accept=".zip,.tar"
        disabled={send.running}
        onFile={(file) => void send.start(file)}
      />
      {sending.value && <Progress {...sending.value} />}
      {problem && <ProblemCard problem={problem} onDismiss={() => send.dismiss()} />}
    </div>
  );
}

function Progress({ upload, sent_bytes, size_bytes }: Sending) {
  const words = text.value.calibration;
  const all_sent = sent_bytes >= size_bytes;
  const progress = all_sent
    ? words.checking
    : words.uploading(bytes(sent_bytes, language.value), bytes(size_bytes, language.value));
  return (
    <div class="stack">
      <progress value={all_sent ? undefined : sent_bytes} max={size_bytes} aria-label={progress} />
      <div class="row">
        <span class="grow">{progress}</span>
        <button type="button" onClick={() => upload.cancel()}>
          {words.cancel_upload}
        </button>
      </div>
    </div>
  );
}

function wrongFileType(): Problem {
  const words = text.value.calibration;
  const title = words.wrong_file_type;
  return {
    type: "urn:sheaf:problem:page",
    title,
    status: 0,
    detail: words.upload_hint,
    remedy: words.wrong_file_type_remedy,
  };
}

function broken(): Problem {
  const words = text.value.calibration;
  const { upload_stopped: title, upload_stopped_remedy: remedy } = words;
  return { type: "urn:sheaf:problem:page", title, status: 0, detail: words.upload_hint, remedy };
}
