/** Changes of the exposures during a session: saved at once, one after the other. */

import { signal } from "@preact/signals";
import { type Api, data } from "../../../api/client";
import { Command } from "../../../state/station/command";
import type { Change } from "../session/session_change";
import type { Session } from "../session/session_state";
import type { Exposures } from "./exposures";

export class ExposureChanges {
  /** What is not saved yet. */
  private readonly unsaved = signal<Partial<Exposures>>({});
  /** Saves what is not saved yet, and what is changed meanwhile; what cannot be saved is dropped. */
  readonly save = new Command(async () => {
    try {
      let sent: Partial<Exposures>;
      let is_accepted: boolean;
      do {
        sent = this.unsaved.peek();
        is_accepted = await this.change((if_match, session) => this.put(if_match, session, sent));
      } while (is_accepted && this.unsaved.peek() !== sent);
    } finally {
      this.unsaved.value = {};
    }
  });

  constructor(
    private readonly api: Api,
    private readonly change: Change,
  ) {}

  /** The exposures of the session with the changes that are not saved yet. */
  shown(session: Session): Exposures {
    return { ...session.body.exposures, ...this.unsaved.value };
  }

  set(changed: Partial<Exposures>): void {
    this.unsaved.value = { ...this.unsaved.peek(), ...changed };
    void this.save.start();
  }

  private async put(if_match: string, session: Session, changed: Partial<Exposures>): Promise<Session> {
    const params = { path: { id: session.id }, header: { "If-Match": if_match } };
    const body = { ...session.body.exposures, ...changed };
    return await data(this.api.PUT("/api/v1/calibration-sessions/{id}/exposures", { params, body }));
  }
}
