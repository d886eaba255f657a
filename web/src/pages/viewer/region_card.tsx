/** The region of the tools: selected in the view or entered as numbers; also the crop box. */

import { Check } from "../../components/fields/check";
import { useForm } from "../../components/fields/form";
import { NumberField } from "../../components/fields/number_field";
import type { Box } from "../../scene/cloud/cloud";
import { AXES, AXIS_NAMES } from "../../scene/cloud/space";
import { language, text } from "../../text";
import { count, decimal } from "../../units";
import type { ViewState } from "./view_state";

export function RegionCard({ state }: { state: ViewState }) {
  const words = text.value.viewer;
  const region = state.region.value;
  return (
    <section class="stack region-card" aria-label={words.region}>
      <div class="row">
        <button
          type="button"
          aria-pressed={state.selecting.value}
          onClick={() => (state.selecting.value = !state.selecting.peek())}
        >
          {words.select_region}
        </button>
        <button type="button" onClick={() => state.selectView()}>
          {words.select_view}
        </button>
        {region && (
          <>
            <button type="button" onClick={() => state.clearRegion()}>
              {words.clear_region}
            </button>
            <Check
              label={words.crop}
              checked={state.crop.value}
              onChange={(checked) => (state.crop.value = checked)}
            />
          </>
        )}
      </div>
      {state.selecting.value && <p role="status">{words.selecting_hint}</p>}
      {state.empty_selection.value && <p class="note">{words.empty_selection}</p>}
      {region ? <RegionFields state={state} region={region} /> : <p class="muted">{words.region_hint}</p>}
    </section>
  );
}

function RegionFields({ state, region }: { state: ViewState; region: Box }) {
  const words = text.value.viewer;
  const form = useForm();
  const change = (end: "min" | "max", axis: 0 | 1 | 2, value: number | undefined) => {
    if (value === undefined) return;
    const corner: Box["min"] = [...region[end]];
    corner[axis] = value;
    state.region.value = { ...region, [end]: corner };
  };
  const { min, max } = region;
  return (
    <details>
      <summary class="number" data-region-points={state.n_region.value}>
        {words.region_facts(
          count(state.n_region.value, language.value),
          AXES.map((axis) => decimal(max[axis] - min[axis], 2, language.value)).join(" × "),
        )}
      </summary>
      <div class="row end region-fields">
        {AXES.map((axis) => (
          <fieldset key={axis} class="row end" aria-label={AXIS_NAMES[axis]}>
            <NumberField
              form={form}
              label={words.axis_from(AXIS_NAMES[axis])}
              unit="mm"
              value={min[axis]}
              max={max[axis]}
              onChange={(value) => change("min", axis, value)}
            />
            <NumberField
              form={form}
              label={words.axis_to(AXIS_NAMES[axis])}
              unit="mm"
              value={max[axis]}
              min={min[axis]}
              onChange={(value) => change("max", axis, value)}
            />
          </fieldset>
        ))}
      </div>
    </details>
  );
}
