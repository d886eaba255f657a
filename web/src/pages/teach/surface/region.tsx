/** The part of a CAD model that is toleranced: a box in the frame of the model. */

import { Check } from "../../../components/fields/check";
import type { Form } from "../../../components/fields/form";
import { NumberField } from "../../../components/fields/number_field";
import type { Box } from "../../../scene/cloud/cloud";
import { text } from "../../../text";
import type { SurfaceDraft } from "./draft";
import { boundsOf, withCoordinate } from "./profile";

const ENDS = ["min", "max"] as const;
const AXES = ["x", "y", "z"] as const;

export function SurfaceRegion({ draft, form }: { draft: SurfaceDraft; form: Form }) {
  const words = text.value.surface;
  const model = draft.model.value;
  const region = draft.region.value;
  return (
    <>
      <Check
        label={words.region}
        checked={region !== undefined}
        disabled={!model}
        onChange={(checked) => {
          draft.region.value = checked && model ? boundsOf(model.summary) : undefined;
        }}
      />
      {region && (
        <fieldset class="stack region" aria-label={words.region}>
          {AXES.map((axis, idx) => (
            <Extent key={axis} axis={axis} idx={idx} region={region} draft={draft} form={form} />
          ))}
        </fieldset>
      )}
    </>
  );
}

interface ExtentProperties {
  axis: string;
  idx: number;
  region: Box;
  draft: SurfaceDraft;
  form: Form;
}

function Extent({ axis, idx, region, draft, form }: ExtentProperties) {
  const words = text.value.surface;
  return (
    <div class="row end">
      {ENDS.map((end) => (
        <NumberField
          key={end}
          form={form}
          label={words.region_ends[end](axis)}
          unit="mm"
          value={region[end][idx]}
          onChange={(value) => {
            if (value !== undefined) draft.region.value = withCoordinate(region, end, idx, value);
          }}
        />
      ))}
    </div>
  );
}
