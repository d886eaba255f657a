/** Uploads an archive with `XMLHttpRequest`, because `fetch` does not report progress. */

import { isProblem, type Problem, ProblemError } from "../../../api/client";
import { textOf } from "../../../api/unknown";

const TYPES: readonly (readonly [RegExp, string])[] = [
  [/\.zip$/i, "application/zip"],
  [/\.tar$/i, "application/x-tar"],
];

/** The media type of an archive by its file name; `undefined` if it is neither ZIP nor TAR. */
export function archiveType(name: string): string | undefined {
  return TYPES.find(([ending]) => ending.test(name))?.[1];
}

/** A running upload. */
export interface Upload {
  done: Promise<{ id: string }>;
  cancel(): void;
}

/** Uploads `file` as a capture; `onProgress` gets the bytes sent. `broken`: the problem if the connection is lost. */
export function upload(
  file: File,
  media_type: string,
  onProgress: (sent_bytes: number) => void,
  broken: Problem,
): Upload {
  const request = new XMLHttpRequest();
  const done = new Promise<{ id: string }>((resolve, reject) => {
    request.upload.onprogress = (event) => onProgress(event.loaded);
    request.onerror = request.ontimeout = () => reject(new ProblemError(broken));
    request.onabort = () => reject(new ProblemError(broken));
    request.onload = () => {
      const answer = answerOf(request.responseText);
      const id = textOf(answer, "id");
      if (request.status === 201 && id !== undefined) resolve({ id });
      else reject(new ProblemError(isProblem(answer) ? answer : { ...broken, status: request.status }));
    };
  });
  const name = encodeURIComponent(file.name.slice(0, 100));
  request.open("POST", `/api/v1/captures?name=${name}`);
  request.setRequestHeader("Content-Type", media_type);
  request.send(file);
  return { done, cancel: () => request.abort() };
}

function answerOf(body: string): unknown {
  try {
    return JSON.parse(body);
  } catch {
    return undefined;
  }
}
