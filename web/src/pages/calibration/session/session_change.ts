/** Changes of a session that may be open in several browsers, with a check for concurrent changes. */

import { signal } from "@preact/signals";
import { useMemo, useRef } from "preact/hooks";
import { type Problem, ProblemError } from "../../../api/client";
import { text } from "../../../text";
import type { Session } from "./session_state";

/** Makes a change based on the newest version this page knows; returns whether it was accepted. */
export type Change = (act: (if_match: string, newest: Session) => Promise<Session>) => Promise<boolean>;

const CHANGED = 412;

export class SessionChanges {
  /** Why the last change was not accepted. */
  readonly conflict = signal<Problem | undefined>(undefined);
  private readonly answered = signal<Session | undefined>(undefined);
  private latest: Session | undefined;
  private last_change: Promise<unknown> = Promise.resolve();

  constructor(private readonly reload: () => Promise<void>) {}

  /** The newest version this page knows, given the one it has loaded. */
  newest(loaded: Session | undefined): Session | undefined {
    this.latest = newer(newer(loaded, this.answered.value), this.latest);
    return this.latest;
  }

  /** Changes of the same page never conflict: each waits for the one before. */
  readonly change: Change = (act) => {
    const made = this.last_change.then(() => this.make(act));
    this.last_change = made.catch(() => undefined);
    return made;
  };

  private async make(act: Parameters<Change>[0]): Promise<boolean> {
    this.conflict.value = undefined;
    if (!this.latest) return false;
    try {
      this.latest = await act(`"${this.latest.version}"`, this.latest);
      this.answered.value = this.latest;
      return true;
    } catch (cause) {
      if (!(cause instanceof ProblemError && cause.problem.status === CHANGED)) throw cause;
      await this.reload();
      this.conflict.value = changedElsewhere(cause.problem);
      return false;
    }
  }
}

/** The newest version loaded by this page, and how to change it. */
export function useSessionChange(loaded: Session | undefined, reload: () => Promise<void>) {
  const newest_reload = useRef(reload);
  newest_reload.current = reload;
  const changes = useMemo(() => new SessionChanges(() => newest_reload.current()), []);
  return { session: changes.newest(loaded), change: changes.change, conflict: changes.conflict };
}

function newer(one: Session | undefined, other: Session | undefined): Session | undefined {
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
