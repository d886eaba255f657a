/** Selects the part on the simulated stage; renders nothing on a real station. */

import { useMemo } from "preact/hooks";
import { data } from "../api/client";
import { useApp } from "../app";
import { SCENES, type SceneName } from "../state/choices";
import { Command } from "../state/station/command";
import { text } from "../text";
import { Choice } from "./fields/choice";
import { useAutoReloaded } from "./loading/auto_reloaded";
import { ProblemCard } from "./problem";

export function SceneChoice({ busy }: { busy: boolean }) {
  const { api, station } = useApp();
  const { scenes, scene_on_stage } = text.value;
  const { state, reload } = useAutoReloaded(
    () => data(api.GET("/api/v1/simulation/scene")),
    ({ kind }) => kind.startsWith("simulation.") || kind.startsWith("job."),
  );
  const place = useMemo(
    () =>
      new Command<[SceneName]>(async (_, scene) => {
        await data(api.PUT("/api/v1/simulation/scene", { body: { scene } }));
        await reload();
      }),
    [api],
  );
  if (station.simulated.value !== "twin") return null;
  const current = state.value.value?.scene ?? "";
  const known = SCENES.some((scene) => scene === current);
  return (
    <div class="stack scene-choice">
      <Choice
        label={scene_on_stage}
        value={current}
        options={(known ? SCENES : [current, ...SCENES]).map((name) => [name, scenes[name] ?? name])}
        disabled={busy || place.running}
        onChange={(name) => {
          const scene = SCENES.find((scene) => scene === name);
          if (scene) void place.start(scene);
        }}
      />
      {state.value.problem && <ProblemCard problem={state.value.problem} />}
      {place.problem.value && <ProblemCard problem={place.problem.value} onDismiss={() => place.dismiss()} />}
    </div>
  );
}
