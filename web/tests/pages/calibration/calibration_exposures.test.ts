/** The exposures of a calibration session: chosen for a new one, changed during it, applied to its live view. */

import { signal } from "@preact/signals";
import { beforeEach, expect, test, vi } from "vitest";
import { makeApi, type Schemas } from "../../../src/api/client";
import type { App } from "../../../src/app";
import { CameraExposure } from "../../../src/pages/calibration/exposures/camera_exposure";
import { ExposureChanges } from "../../../src/pages/calibration/exposures/exposure_changes";
import {
  AMBIENT_LEVELS,
  type Exposures,
  withSubtraction,
} from "../../../src/pages/calibration/exposures/exposures";
import { LiveBoard } from "../../../src/pages/calibration/session/live_board";
import { draftFrom, requestOf } from "../../../src/pages/calibration/session/new_session";
import { SessionChanges } from "../../../src/pages/calibration/session/session_change";
import type { Session } from "../../../src/pages/calibration/session/session_state";

const PUT_EXPOSURES = "PUT /api/v1/calibration-sessions/s/exposures";
const PATCH_CAMERA = "PATCH /api/v1/devices/camera/settings";
const PUT_LIVE = "PUT /api/v1/station/live";

const EXPOSURES: Exposures = {
  board_exposure_us: 20_000,
  laser_exposure_us: 800,
  laser_power: 1,
  background_above_levels: AMBIENT_LEVELS,
};

const LIVE = "Operational.ContinuousExecution";
const READY = "Operational.Ready";

interface Sent {
  request: string;
  if_match: string | null;
  body: unknown;
}

const sessionOf = (exposures: Partial<Exposures>, version = 1) =>
  ({ id: "s", version, body: { exposures: { ...EXPOSURES, ...exposures }, poses: [] } }) as unknown as Session;

/** The session and the exposure of the camera on the server. */
let stored: Session;
let camera_us: number;
/** Requests that change something. */
let sent: Sent[];
/** A status with which the next of them is refused. */
let refusal: number | undefined;
/** What happens before the server carries out the next of them. */
let meanwhile: (request: string) => Promise<void>;

const respond = (body: unknown, status = 200) =>
  new Response(JSON.stringify(body), { status, headers: { "content-type": "application/json" } });

beforeEach(() => {
  [stored, camera_us, sent, refusal, meanwhile] = [sessionOf({}), 5000, [], undefined, async () => {}];
  vi.stubGlobal("location", { origin: "http://station", hash: "" });
  vi.stubGlobal("fetch", async (request: Request) => {
    const name = `${request.method} ${new URL(request.url).pathname}`;
    if (request.method === "GET") return respond({ exposure_us: camera_us });
    const body: unknown = await request.json();
    sent.push({ request: name, if_match: request.headers.get("If-Match"), body });
    if (refusal !== undefined) return respond({ title: "Refused", detail: "no", status: refusal }, refusal);
    await meanwhile(name);
    if (name === PATCH_CAMERA) camera_us = (body as { exposure_us: number }).exposure_us;
    if (name === PUT_EXPOSURES) stored = sessionOf(body as Exposures, stored.version + 1);
    return respond(name === PUT_EXPOSURES ? stored : {});
  });
});

const makeTestApi = () =>
  makeApi(
    () => undefined,
    () => "Anna",
  );

test("a new session is requested with the exposures of the form, which begin with the defaults", () => {
  const defaults = {
    target: { kind: "charuco" },
    projector: { kind: "cross" },
    exposures: EXPOSURES,
  } as unknown as Schemas["SessionDefaultsDto"];
  const draft = draftFrom(defaults);
  expect(draft.exposures).toEqual(EXPOSURES);
  const exposures = { ...draft.exposures, laser_power: 0.25, ...withSubtraction(false, 20) };
  expect(requestOf("Monday", { ...draft, exposures })).toEqual({
    name: "Monday",
    target: defaults.target,
    projector: defaults.projector,
    exposures: { ...EXPOSURES, laser_power: 0.25, background_above_levels: null },
  });
});

test("without subtraction there is no limit of the ambient light; with it, the one given", () => {
  expect(withSubtraction(false, 35)).toEqual({ background_above_levels: null });
  expect(withSubtraction(true, 35)).toEqual({ background_above_levels: 35 });
  expect(withSubtraction(true, 0)).toEqual({ background_above_levels: 0 });
});

/** A page that has loaded the stored session. */
function page() {
  const reload = vi.fn(async () => {});
  const changes = new SessionChanges(reload);
  changes.newest(stored);
  return { changes, reload, exposures: new ExposureChanges(makeTestApi(), changes.change) };
}

test("each change is saved with the version it is based on, and keeps those before", async () => {
  const { changes, exposures } = page();
  exposures.set({ board_exposure_us: 9000 });
  expect(exposures.shown(sessionOf({})).board_exposure_us).toBe(9000);
  // Changed while the first is under way.
  exposures.set({ laser_power: 0.5 });
  exposures.set(withSubtraction(false, 20));
  await vi.waitFor(() => expect(exposures.save.running).toBe(false));
  const first = { ...EXPOSURES, board_exposure_us: 9000 };
  const all = { ...first, laser_power: 0.5, background_above_levels: null };
  expect(sent).toEqual([
    { request: PUT_EXPOSURES, if_match: '"1"', body: first },
    { request: PUT_EXPOSURES, if_match: '"2"', body: all },
  ]);
  expect(changes.newest(undefined)?.version).toBe(3);
  // What is saved is no longer laid over the session.
  expect(exposures.shown(sessionOf({})).board_exposure_us).toBe(20_000);
});

test("a change waits for the image that is being captured, and is based on the session with it", async () => {
  const { changes, exposures } = page();
  let capture: (session: Session) => void = () => {};
  const captured = changes.change(
    () =>
      new Promise((resolve) => {
        capture = resolve;
      }),
  );
  exposures.set({ laser_exposure_us: 400 });
  await new Promise((resolve) => setTimeout(resolve));
  expect(sent).toEqual([]);
  capture(sessionOf({}, 7));
  expect(await captured).toBe(true);
  await vi.waitFor(() => expect(sent.map(({ if_match }) => if_match)).toEqual(['"7"']));
});

test("a change that is refused says why, and the fields show what is saved", async () => {
  const { exposures } = page();
  refusal = 422;
  exposures.set({ board_exposure_us: 9000 });
  await vi.waitFor(() => expect(exposures.save.problem.value?.detail).toBe("no"));
  expect(exposures.shown(stored)).toEqual(EXPOSURES);
  refusal = undefined;
  exposures.set({ board_exposure_us: 8000 });
  await vi.waitFor(() => expect(stored.body.exposures.board_exposure_us).toBe(8000));
  expect(exposures.save.problem.value).toBeUndefined();
});

test("a change of an outdated page is dropped, the session loaded again, and the next one sent", async () => {
  const { changes, reload, exposures } = page();
  refusal = 412;
  exposures.set({ board_exposure_us: 9000 });
  await vi.waitFor(() => expect(exposures.save.running).toBe(false));
  expect([changes.conflict.value?.status, reload.mock.calls.length, sent.length]).toEqual([412, 1, 1]);
  expect(exposures.shown(stored)).toEqual(EXPOSURES);
  refusal = undefined;
  exposures.set({ laser_power: 0.5 });
  await vi.waitFor(() => expect(exposures.save.running).toBe(false));
  expect(changes.conflict.value).toBeUndefined();
  expect(sent[1]?.body).toEqual({ ...EXPOSURES, laser_power: 0.5 });
});

/** The live view of a session, not running yet; `control`: whether this page has control, and who else does. */
function station(in_control = true, other?: string) {
  const state = signal(READY);
  const mine = signal(in_control);
  const ensure = vi.fn(async () => {
    mine.value = true;
  });
  const app = {
    api: makeTestApi(),
    control: { ensure, mine, other: signal(other), id: () => "lease" },
    station: {
      status: {
        get value() {
          return { state: state.value };
        },
      },
    },
  } as unknown as App;
  const board = new LiveBoard(app, sessionOf({}), () => {});
  return { app, state, mine, ensure, board };
}

const exposed = () => sent.filter(({ request }) => request === PATCH_CAMERA).map(({ body }) => body);

test("a changed board exposure applies to the running live view, and the previous one is restored", async () => {
  const { board, state } = station();
  await board.start();
  expect(camera_us).toBe(20_000);
  state.value = LIVE;
  await board.follow(sessionOf({ board_exposure_us: 9000 }, 2));
  expect(camera_us).toBe(9000);
  // Another setting of the session does not concern the camera.
  await board.follow(sessionOf({ board_exposure_us: 9000, laser_power: 0.5 }, 3));
  await board.stop();
  expect(camera_us).toBe(5000);
  // The status of the station still shows the live view.
  await board.follow(sessionOf({ board_exposure_us: 7000 }, 4));
  expect(exposed()).toEqual([20_000, 9000, 5000].map((exposure_us) => ({ exposure_us })));
  expect(sent.map(({ request }) => request)).toEqual([
    PATCH_CAMERA,
    PUT_LIVE,
    PATCH_CAMERA,
    PUT_LIVE,
    PATCH_CAMERA,
  ]);
});

test("without a live view a changed exposure waits for its start", async () => {
  const { board, state } = station();
  await board.follow(sessionOf({ board_exposure_us: 9000 }, 2));
  expect(sent).toEqual([]);
  await board.start();
  expect(camera_us).toBe(9000);
  // The capture of an image ends the live view; it starts again with what was changed meanwhile.
  [state.value, board.paused] = [LIVE, true];
  await board.follow(sessionOf({ board_exposure_us: 8000 }, 3));
  expect(camera_us).toBe(9000);
  await board.start();
  expect(camera_us).toBe(8000);
  await board.stop();
  expect(camera_us).toBe(5000);
});

test("a change that arrives while the live view starts is not lost", async () => {
  const { board } = station();
  meanwhile = async (request) => {
    if (request === PUT_LIVE) await board.follow(sessionOf({ board_exposure_us: 9000 }, 2));
  };
  await board.start();
  expect(camera_us).toBe(9000);
});

test("someone else's live view keeps its exposure; control of one without a holder is taken", async () => {
  const theirs = station(false, "Ben");
  theirs.state.value = LIVE;
  await theirs.board.takeIfFree();
  await theirs.board.follow(sessionOf({ board_exposure_us: 9000 }, 2));
  expect([theirs.ensure.mock.calls.length, exposed()]).toEqual([0, []]);
  const free = station(false);
  await free.board.takeIfFree();
  expect(free.ensure).not.toHaveBeenCalled();
  free.state.value = LIVE;
  await free.board.takeIfFree();
  await free.board.follow(sessionOf({ board_exposure_us: 9000 }, 2));
  expect(camera_us).toBe(9000);
});

test("a refused exposure says why until the next one is accepted", async () => {
  const { board, state } = station();
  state.value = LIVE;
  refusal = 422;
  await board.follow(sessionOf({ board_exposure_us: 9000 }, 2));
  expect(board.exposure_problem.value?.detail).toBe("no");
  refusal = undefined;
  await board.follow(sessionOf({ board_exposure_us: 8000 }, 3));
  expect([board.exposure_problem.value, camera_us]).toEqual([undefined, 8000]);
});

test("an exposure that is restored while another one is being set ends as it was", async () => {
  const exposure = new CameraExposure(station().app);
  await exposure.set(20_000);
  // The camera is slow with the first of them.
  meanwhile = async () => {
    meanwhile = async () => {};
    await new Promise((resolve) => setTimeout(resolve, 20));
  };
  await Promise.all([exposure.set(9000), exposure.restore()]);
  expect([camera_us, exposure.is_changed]).toEqual([5000, false]);
  await exposure.restore();
  expect(exposed()).toEqual([20_000, 9000, 5000].map((exposure_us) => ({ exposure_us })));
});
