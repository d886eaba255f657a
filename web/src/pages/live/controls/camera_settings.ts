/** Editing of the camera settings: read with their version, and changed only if no one else has changed them. */

import { computed, signal } from "@preact/signals";
import { type Api, data, type Problem, ProblemError, problemOf, type Schemas } from "../../../api/client";
import { Command } from "../../../state/station/command";
import type { Control } from "../../../state/station/control";

/** The settings that can be edited on this page. */
export interface Draft {
  exposure_us?: number | undefined;
  gain_db?: number | undefined;
  frame_rate_hz?: number | undefined;
}

/** The names of these settings. */
const NAMES = ["exposure_us", "gain_db", "frame_rate_hz"] as const;

/** The changed settings, the only ones sent. */
type Change = { [Name in keyof Draft]?: number };

/** HTTP status if the version is outdated. */
const PRECONDITION_FAILED = 412;

export class CameraSettings {
  /** The result of the last change. */
  readonly note = signal<"none" | "accepted" | "changed_by_other">("none");
  /** Why the settings could not be read. */
  readonly problem = signal<Problem | undefined>(undefined);
  private readonly read = signal<{ settings: Schemas["CameraSettingsDto"]; etag: string } | undefined>(undefined);
  private readonly typed = signal<Draft>({});

  constructor(
    private readonly api: Api,
    private readonly control: Control,
  ) {}

  /** The settings with unsaved input. */
  readonly draft = computed<Draft>(() => {
    const settings = this.read.value?.settings;
    return {
      exposure_us: settings?.exposure_us,
      gain_db: settings?.gain_db,
      frame_rate_hz: settings?.frame_rate_hz,
      ...this.typed.value,
    };
  });

  /** Whether the input differs from the settings. */
  readonly changed = computed(() => Object.keys(this.difference(this.typed.value)).length > 0);

  /** Sends the input; shows the values accepted by the camera. */
  readonly apply = new Command(async () => {
    await this.control.ensure();
    const { api, control } = this;
    this.note.value = "none";
    const header = { "Sheaf-Control": control.id() ?? "", "If-Match": this.read.peek()?.etag ?? "" };
    const body = this.difference(this.typed.peek());
    try {
      this.take(await versioned(api.PATCH("/api/v1/devices/camera/settings", { params: { header }, body })));
      this.typed.value = {};
      this.note.value = "accepted";
    } catch (cause) {
      if (!(cause instanceof ProblemError) || cause.problem.status !== PRECONDITION_FAILED) throw cause;
      await this.reload();
      this.note.value = "changed_by_other";
    }
  });

  /** Adds input to the draft. */
  draw(change: Draft): void {
    this.typed.value = { ...this.typed.peek(), ...change };
    this.note.value = "none";
  }

  /** Multiplies the exposure and applies it immediately. */
  scaleExposure(factor: number): void {
    const { exposure_us } = this.draft.peek();
    if (exposure_us === undefined) return;
    this.draw({ exposure_us: Math.round(factor * exposure_us) });
    void this.apply.start();
  }

  /** Auto exposure by the server: the lines of the live view become bright but not saturated. */
  readonly auto = new Command(async (steps) => {
    await this.control.ensure();
    this.discard();
    steps.accepted();
    const header = { "Sheaf-Control": this.control.id() ?? "" };
    this.take(await versioned(this.api.POST("/api/v1/devices/camera/auto-exposure", { params: { header } })));
    this.note.value = "accepted";
  });

  /** Discards the input. */
  discard(): void {
    this.typed.value = {};
    this.note.value = "none";
  }

  /** Reloads after a possible change by someone else; not while a change is pending. */
  async follow(): Promise<void> {
    const phase = this.apply.phase.peek();
    // Unsaved input is based on the loaded settings; if these have changed, the server refuses it.
    if (phase === "requested" || this.changed.peek()) return;
    try {
      await this.reload();
      this.problem.value = undefined;
    } catch (cause) {
      this.problem.value = problemOf(cause);
    }
  }

  private async reload(): Promise<void> {
    this.take(await versioned(this.api.GET("/api/v1/devices/camera/settings")));
  }

  private take(read: { settings: Schemas["CameraSettingsDto"]; etag: string }): void {
    this.read.value = read;
  }

  private difference(typed: Draft): Change {
    const settings = this.read.value?.settings;
    const change: Change = {};
    for (const name of NAMES) {
      const value = typed[name];
      if (value !== undefined && value !== settings?.[name]) change[name] = value;
    }
    return change;
  }
}

async function versioned(
  asked: Promise<{ data?: Schemas["CameraSettingsDto"]; error?: unknown; response: Response }>,
): Promise<{ settings: Schemas["CameraSettingsDto"]; etag: string }> {
  const settings = await data(asked);
  return { settings, etag: (await asked).response.headers.get("ETag") ?? "" };
}
