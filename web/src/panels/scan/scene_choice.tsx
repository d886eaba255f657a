/** What lies on the simulated stage; a real station has no such choice. */

import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { data, type Schemas } from "../../api/client";
import { useApp } from "../../app";
import { useLoaded } from "../../parts/loading";
import { ProblemCard } from "../../parts/problem";
import { Command } from "../../state/command";
import { text } from "../../text";

type SceneName = Schemas["SceneNameDto"];

const SCENES: readonly SceneName[] = ["sphere", "gauge", "freeform", "plate"];

export function SceneChoice({ busy }: { busy: boolean }) {
  const { api, station } = useApp();
  const words = text.value.scan;
  const wanted = useSignal<SceneName>("sphere");
  const { state, reload } = useLoaded(async () => await data(api.GET("/api/v1/simulation/scene")), [api], [busy]);
  const place = useMemo(
    () =>
      new Command(async () => {
        await data(api.PUT("/api/v1/simulation/scene", { body: { scene: wanted.peek() } }));
        await reload();
      }),
    [api],
  );
  if (station.simulated.value !== "twin") return null;
  const lying = state.value.value?.scene ?? "";
  const known = SCENES.some((scene) => scene === lying);
  return (
    <div class="stack scene-choice">
      <label class="field">
        <span>{words.scene}</span>
        <select
          value={lying}
          disabled={busy || place.running}
          onChange={(event) => {
            wanted.value = event.currentTarget.value as SceneName;
            void place.start();
          }}
        >
          {!known && <option value={lying}>{words.scenes[lying] ?? lying}</option>}
          {SCENES.map((scene) => (
            <option key={scene} value={scene}>
              {words.scenes[scene]}
            </option>
          ))}
        </select>
      </label>
      {place.problem.value && <ProblemCard problem={place.problem.value} onDismiss={() => place.dismiss()} />}
    </div>
  );
}
