/** The real program with its simulated station. */

import { type ChildProcess, spawn } from "node:child_process";
import { cpSync, existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";
import type { Job } from "../../src/api/client";

/** Longest time from the start of the program to its URL on a busy machine. */
const URL_WITHIN_MS = 60_000;

/** Longest time a job of the simulated station may take on a busy machine. */
const JOB_WITHIN_MS = 240_000;

/** A calibration that a late simulated camera has spoilt is begun again so often. */
const CALIBRATED_AGAIN = 6;

/** Rows of clouds to be viewed: the processor draws them, so only pictures for the documents are dense. */
export const VIEWED_ROWS = { from_mm: -12, to_mm: 12, step_mm: process.env.SHEAF_PICTURES ? 0.4 : 0.8 };

export const ROOT = resolve(import.meta.dirname, "../../..");
/** The program under test. */
export const SHEAF =
  process.env.SHEAF_BIN ?? join(process.env.CARGO_TARGET_DIR ?? join(ROOT, "target"), "debug/sheaf");

/** A running `sheaf serve` on a folder of its own. */
export class Server {
  private constructor(
    readonly url: string,
    private readonly process: ChildProcess,
    readonly folder: string,
    private readonly args: readonly string[],
  ) {}

  static async start(args: readonly string[] = []): Promise<Server> {
    return await Server.on(newFolder(), "127.0.0.1:0", args);
  }

  /** On a copy of the data of another one, which has ended. */
  static async onCopyOf(data: string): Promise<Server> {
    const folder = newFolder();
    cpSync(data, folder, { recursive: true });
    return await Server.on(folder, "127.0.0.1:0", []);
  }

  private static async on(folder: string, listen: string, args: readonly string[]): Promise<Server> {
    if (!existsSync(SHEAF)) throw new Error(`${SHEAF} is missing: cargo build --package sheaf`);
    const child = spawn(SHEAF, ["serve", "--listen", listen, "--data", join(folder, "data"), ...args], {
      stdio: ["ignore", "pipe", "ignore"],
      env: environment(),
    });
    const lines = createInterface({ input: child.stdout });
    const url = await new Promise<string>((found, failed) => {
      const timer = setTimeout(() => failed(new Error("no URL")), URL_WITHIN_MS);
      child.once("exit", (code) => failed(new Error(`sheaf ended with ${code} before it listened`)));
      lines.on("line", (line) => {
        const url = /http:\/\/[^\s/]+/.exec(line)?.[0];
        if (!url) return;
        clearTimeout(timer);
        found(url);
      });
    });
    return new Server(url, child, folder, args);
  }

  /** Ends the process at once, as a power cut would; the data stay. */
  async kill(): Promise<void> {
    await this.end("SIGKILL");
  }

  /** Ends the process as a service manager would; the data stay. */
  async terminate(): Promise<void> {
    await this.end("SIGTERM");
  }

  /** Starts again on the same data and the same port. */
  async startAgain(): Promise<Server> {
    return await Server.on(this.folder, new URL(this.url).host, this.args);
  }

  /** Ends the process and deletes its data. */
  async stop(): Promise<void> {
    await this.end("SIGTERM");
    rmSync(this.folder, { recursive: true, force: true });
  }

  private async end(signal: NodeJS.Signals): Promise<void> {
    if (this.process.exitCode !== null || this.process.signalCode !== null) return;
    const ended = new Promise((resolve) => this.process.once("exit", resolve));
    this.process.kill(signal);
    await ended;
  }

  /** A request past the page; demands success. */
  async call<T = unknown>(method: string, path: string, body?: unknown, headers: HeadersInit = {}): Promise<T> {
    const init: RequestInit = { method, headers: { ...headers, "content-type": "application/json" } };
    if (body !== undefined) init.body = JSON.stringify(body);
    const response = await fetch(this.url + path, init);
    const text = await response.text();
    if (!response.ok) throw new Error(`${method} ${path}: ${response.status} ${text}`);
    return (text === "" ? undefined : JSON.parse(text)) as T;
  }

  /** Starts a job and waits until it has succeeded. */
  async job(path: string, body: unknown): Promise<Job> {
    const { id } = await this.call<Job>("POST", path, body);
    const begun = Date.now();
    for (;;) {
      const job = await this.call<Job>("GET", `/api/v1/jobs/${id}`);
      if (job.state === "succeeded") return job;
      if (job.state !== "queued" && job.state !== "running") throw new Error(`${job.state}: ${job.message}`);
      if (Date.now() - begun > JOB_WITHIN_MS) throw new Error(`still ${job.state}: ${job.message}`);
      await new Promise((resolve) => setTimeout(resolve, 200));
    }
  }

  /** Acknowledges faults, as a person would. */
  async reset(): Promise<void> {
    const holder = { holder: "Test", take_over: true };
    const { id } = await this.call<{ id: string }>("POST", "/api/v1/station/control", holder);
    const control = { "Sheaf-Control": id };
    await this.call("POST", "/api/v1/station/reset", undefined, control);
    await this.call("DELETE", "/api/v1/station/control", undefined, control);
  }

  /** Calibrates the station and activates the calibration. */
  async calibrate(): Promise<void> {
    const start = () => this.job("/api/v1/calibrations", { source: { kind: "station" } });
    let job = await start().catch(takenForFault);
    // On a busy machine the simulated camera may be late, which the station takes for a fault.
    for (let again = 0; !job && again < CALIBRATED_AGAIN; again++) {
      await this.reset();
      job = await start().catch(takenForFault);
    }
    if (!job) throw new Error("the simulated camera was always late: the machine is too busy");
    await this.call("PUT", "/api/v1/calibrations/active", { calibration_id: job.result?.id ?? "" });
  }

  /** Scans the part on the simulated stage and returns the id of the scan, whose cloud is to be viewed. */
  async scan(): Promise<string> {
    const job = await this.job("/api/v1/scans", { source: { kind: "station" }, ...VIEWED_ROWS });
    return job.result?.id ?? "";
  }
}

function newFolder(): string {
  return mkdtempSync(join(tmpdir(), "sheaf-browser-"));
}

/** The environment without the variables of this harness, which the server would report as misspelt settings. */
function environment(): NodeJS.ProcessEnv {
  const own = ["SHEAF_BIN", "SHEAF_CHROMIUM", "SHEAF_PICTURES", "SHEAF_GOLDEN"];
  return Object.fromEntries(Object.entries(process.env).filter(([name]) => !own.includes(name)));
}

/** Lets pass that the station missed a frame; everything else is a mistake. */
function takenForFault(cause: unknown): undefined {
  if (!/no frame arrived/.test(String(cause))) throw cause;
}
