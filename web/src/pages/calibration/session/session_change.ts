/** Changes of a session that may be open in several browsers, with a check for concurrent changes. */

import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { type Problem, ProblemError } from "../../../api/client";
import { text } from "../../../text";
import type { Session } from "./session_state";

/** Makes a change based on the version this page has loaded; returns whether it was accepted. */
export type Change = (act: (if_match: string) => Promise<Session>) => Promise<boolean>;

const CHANGED = 412;

/** The newest version loaded by this page, and how to change it. */
export function useSessionChange(loaded: Session | undefined, reload: () => Promise<void>) {
  const answered = useSignal<Session | undefined>(undefined);
  const conflict = useSignal<Problem | undefined>(undefined);
  const latest = useRef<Session | undefined>(undefined);
  const session = newest(loaded, answered.value);
  latest.current = newest(session, latest.current);
  const change: Change = async (act) => {
    conflict.value = undefined;
    try {
      const next = await act(`"${latest.current?.version ?? 0}"`);
      latest.current = next;
      answered.value = next;
      return true;
    } catch (cause) {
      if (!(cause instanceof ProblemError && cause.problem.status === CHANGED)) throw cause;
      await reload();
      conflict.value = changedElsewhere(cause.problem);
      return false;
    }
  };
  return { session, change, conflict };
}

function newest(one: Session | undefined, other: Session | undefined): Session | undefined {
  return one && other ? (other.version > one.version ? other : one) : (one ?? other);
}

function changedElsewhere(problem: Problem): Problem {
  const words = text.value.calibration;
  return {
    ...problem,
    type: "urn:sheaf:problem:page",
    title: words.changed_elsewhere,
    detail: words.changed_elsewhere_detail,
    remedy: words.changed_elsewhere_remedy,
  };
}
