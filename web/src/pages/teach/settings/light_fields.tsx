/** Exposures, laser power, ambient light, and what is saved of the images. */

import type { ComponentChildren } from "preact";
import { Check } from "../../../components/fields/check";
import { Choice } from "../../../components/fields/choice";
import type { Form } from "../../../components/fields/form";
import { AmbientLevelsField, LaserPowerField } from "../../../components/fields/light_fields";
import { NumberField } from "../../../components/fields/number_field";
import { text } from "../../../text";
import { EXPOSURE_COUNTS } from "../../scan/acquisition";
import type { RecipeSettings } from "./recipe_settings";
import { modeOf, withExposures } from "./scan_draft";

interface Properties {
  settings: RecipeSettings;
  form: Form;
}

export function LightFields({ settings, form }: Properties) {
  const words = text.value.scan;
  const { laser_power, background, keep_frames, record } = settings.scan.value;
  return (
    <>
      <Exposures settings={settings} form={form}>
        <LaserPowerField
          form={form}
          optional
          value={laser_power}
          onChange={(laser_power) => settings.changeScan({ laser_power })}
        />
      </Exposures>
      <Check
        label={words.subtract_ambient}
        checked={background !== undefined}
        onChange={(checked) => settings.changeScan({ background: checked ? {} : undefined })}
      />
      {background && <Ambient settings={settings} form={form} />}
      <Check
        label={words.keep_frames}
        checked={keep_frames}
        onChange={(checked) => settings.changeScan({ keep_frames: checked })}
      />
      <Check
        label={words.record}
        checked={record}
        onChange={(checked) => settings.changeScan({ record: checked })}
      />
    </>
  );
}

function Exposures({ settings, form, children }: Properties & { children: ComponentChildren }) {
  const words = text.value.scan;
  const { exposures_us } = settings.scan.value;
  const n = exposures_us.length;
  const change = (idx: number, value: number | undefined) =>
    settings.changeScan({ exposures_us: exposures_us.map((one, at) => (at === idx ? value : one)) });
  return (
    <div class="row end">
      <Choice
        label={words.n_exposures}
        value={n}
        options={EXPOSURE_COUNTS.map((one) => [one, words.exposure_counts(one)])}
        onChange={(one) => (settings.scan.value = withExposures(settings.scan.peek(), one))}
      />
      {exposures_us.map((value, idx) => (
        <NumberField
          key={`${n}-${idx}`}
          form={form}
          label={n > 1 ? text.value.recipe_settings.exposure(idx + 1) : words.exposure}
          unit="µs"
          optional={n === 1}
          min={1}
          placeholder={n === 1 ? words.automatic : ""}
          value={value}
          onChange={(value) => change(idx, value)}
        />
      ))}
      {children}
    </div>
  );
}

/** When images with the laser off are captured. */
function Ambient({ settings, form }: Properties) {
  const words = text.value.scan;
  const { background, ...scan } = settings.scan.value;
  const { every_rows, above_levels } = background ?? {};
  return (
    <div class="row end">
      {modeOf(scan) === "stop_and_go" && (
        <NumberField
          form={form}
          label={words.ambient_rows}
          unit={words.rows_unit}
          optional
          whole
          min={1}
          placeholder="1"
          value={every_rows ?? undefined}
          onChange={(value) => settings.changeScan({ background: { ...background, every_rows: value ?? null } })}
        />
      )}
      <AmbientLevelsField
        form={form}
        optional
        value={above_levels ?? undefined}
        onChange={(value) => settings.changeScan({ background: { ...background, above_levels: value ?? null } })}
      />
    </div>
  );
}
