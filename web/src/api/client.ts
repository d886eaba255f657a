/** The typed client of the REST API: every response is data or a `ProblemError` with cause and remedy. */

import createClient, { type Client, type Middleware } from "openapi-fetch";
import type { components, paths } from "./schema";
import { fieldOf, textOf } from "./unknown";

export type Schemas = components["schemas"];
export type Problem = Schemas["Problem"];
export type Station = Schemas["StationDto"];
export type Job = Schemas["JobDto"];

/** An error response of the server, or a failed request. */
export class ProblemError extends Error {
  constructor(readonly problem: Problem) {
    super(problem.detail);
  }
}

/** Converts any error to a problem, so that all pages show errors in the same way. */
export function problemOf(cause: unknown): Problem {
  if (cause instanceof ProblemError) return cause.problem;
  const unreachable = cause instanceof TypeError;
  return {
    type: unreachable ? "urn:sheaf:problem:unreachable" : "urn:sheaf:problem:page-mistake",
    title: unreachable ? "Server not reachable" : "Error in this page",
    status: 0,
    detail: cause instanceof Error ? cause.message : String(cause),
    ...(unreachable ? { remedy: "check the server and the network; nothing was lost" } : {}),
  };
}

interface ApiResponse<T> {
  data?: T;
  error?: unknown;
  response: Response;
}

/** Returns the data of the response; throws a `ProblemError` on an error response. */
export async function data<T>(request: Promise<ApiResponse<T>>): Promise<T> {
  const { data, error, response } = await request;
  // Without a body (204), `data` is undefined, and so is `T`.
  if (response.ok) return data as T;
  throw errorFromResponse(error, response);
}

/** Whether a body is problem details (RFC 9457). */
export function isProblem(body: unknown): body is Problem {
  return textOf(body, "title") !== undefined && textOf(body, "detail") !== undefined;
}

function errorFromResponse(error: unknown, response: Response): ProblemError {
  if (isProblem(error)) return new ProblemError(error);
  const detail = `the server responded with status ${response.status} and gave no reason`;
  return new ProblemError({ type: "about:blank", title: response.statusText, status: response.status, detail });
}

/** Downloads a URL; throws a `ProblemError` on an error response. */
export async function bytes(href: string, init?: RequestInit): Promise<Response> {
  const response = await fetch(href, init);
  if (!response.ok) throw errorFromResponse(await response.json().catch(() => undefined), response);
  return response;
}

/** Result of a Stop; both fields are undefined if the response is not a stop result. */
export interface StopResult {
  acknowledged?: boolean | undefined;
  state?: string | undefined;
}

/**
 * Requests Stop, with `keepalive` so that the request completes even if the page is closed. The caller sets the time
 * limit.
 */
export async function postStop(actor: string, signal: AbortSignal): Promise<StopResult> {
  const headers = { "Sheaf-Actor": headerText(actor) };
  const answer = await fetch("/api/v1/station/stop", { method: "POST", keepalive: true, headers, signal });
  const body: unknown = await answer.json();
  const acknowledged = fieldOf(body, "acknowledged");
  return {
    acknowledged: typeof acknowledged === "boolean" ? acknowledged : undefined,
    state: textOf(body, "state"),
  };
}

export type Api = Client<paths>;

/** Creates the client; `control` returns the id of this page's control lease, `actor` the user's name. */
export function makeApi(control: () => string | undefined, actor: () => string): Api {
  const api = createClient<paths>({ baseUrl: location.origin });
  const carryControl: Middleware = {
    onRequest({ request }) {
      if (request.method === "GET") return request;
      const id = control();
      if (id && !request.headers.has("Sheaf-Control")) request.headers.set("Sheaf-Control", id);
      request.headers.set("Sheaf-Actor", headerText(actor()));
      return request;
    },
  };
  api.use(carryControl);
  return api;
}

/** Encodes text for an HTTP header: one character per byte of its UTF-8 encoding. */
function headerText(text: string): string {
  return String.fromCharCode(...new TextEncoder().encode(text));
}

/** An idempotency key for a `POST`. `crypto.randomUUID` is available in secure contexts only. */
export function idempotencyKey(): string {
  const random = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(random, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
