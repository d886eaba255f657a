/** The settings page: preferences of this browser, doors to other systems, and the simulated station. */

import { useId } from "preact/hooks";
import { useApp } from "../../app";
import { CopyLine } from "../../components/copy_line";
import { Check } from "../../components/fields/check";
import { Choice } from "../../components/fields/choice";
import { NameField } from "../../components/fields/name_field";
import { selected } from "../../components/fields/selected";
import { light_tower } from "../../state/browser/light_tower";
import { href } from "../../state/browser/route";
import { letter_shortcuts } from "../../state/browser/shortcuts";
import { THEMES, theme_choice } from "../../state/browser/theme";
import { LANGUAGE_CODES, LANGUAGES, language, text } from "../../text";
import { dateTime, decimal, length } from "../../units";
import { Doors } from "./doors/doors";
import { Simulation } from "./simulation";
import "./settings.css";

/** Examples of how the page formats numbers and times. */
const EXAMPLE_MM = -1234.5678;
const EXAMPLE_AT = new Date(2026, 0, 31, 14, 5, 9).getTime();

export default function Settings() {
  const { station } = useApp();
  return (
    <div class="stack settings">
      <h1>{text.value.settings.title}</h1>
      <div class="settings-grid">
        <User />
        <Appearance />
        <Station />
      </div>
      <Doors />
      {station.simulated.value === "twin" && <Simulation />}
    </div>
  );
}

function User() {
  const words = text.value.settings;
  return (
    <section class="card stack" aria-label={words.user}>
      <h2>{words.user}</h2>
      <NameField />
      <p class="muted">{words.user_hint}</p>
      <Check
        label={words.letters}
        checked={letter_shortcuts.value}
        onChange={(checked) => (letter_shortcuts.value = checked)}
      />
      <p class="muted">
        {words.letters_hint} <a href={href("help", "shortcuts")}>{text.value.help.shortcuts}</a>
      </p>
    </section>
  );
}

function Appearance() {
  const words = text.value.settings;
  const id = useId();
  return (
    <section class="card stack" aria-label={words.appearance}>
      <h2>{words.appearance}</h2>
      <div class="field">
        <label for={`${id}-language`}>{words.language}</label>
        <select
          id={`${id}-language`}
          value={language.value}
          onChange={(event) => {
            language.value = selected(event, LANGUAGE_CODES) ?? language.value;
          }}
        >
          {LANGUAGE_CODES.map((code) => (
            <option key={code} value={code} lang={code}>
              {LANGUAGES[code]}
            </option>
          ))}
        </select>
      </div>
      <Choice
        label={words.theme}
        value={theme_choice.value}
        options={THEMES.map((choice) => [choice, words.themes[choice]])}
        onChange={(choice) => (theme_choice.value = choice)}
      />
      <Check
        label={words.light_tower}
        checked={light_tower.value}
        onChange={(checked) => (light_tower.value = checked)}
      />
      <dl class="facts">
        <dt>{words.numbers}</dt>
        <dd>
          {decimal(EXAMPLE_MM, 3, language.value)} mm, {length(0.0083, language.value)}
        </dd>
        <dt>{words.times}</dt>
        <dd>{dateTime(EXAMPLE_AT, language.value)}</dd>
      </dl>
      <p class="muted">{words.numbers_hint}</p>
    </section>
  );
}

function Station() {
  const { station } = useApp();
  const words = text.value.settings;
  const camera = station.status.value?.camera.settings;
  return (
    <section class="card stack" aria-label={words.station}>
      <h2>{words.station}</h2>
      {camera && (
        <dl class="facts live-data">
          <dt>{words.exposure}</dt>
          <dd>{decimal(camera.exposure_us, 0, language.value)} µs</dd>
          <dt>{words.gain}</dt>
          <dd>{decimal(camera.gain_db, 1, language.value)} dB</dd>
          <dt>{words.frame_rate}</dt>
          <dd>{decimal(camera.frame_rate_hz, 1, language.value)} Hz</dd>
        </dl>
      )}
      <a class="button" href={href("live")}>
        {words.camera}
      </a>
      <h3>{words.api}</h3>
      <CopyLine line={`${location.origin}/api/v1`} />
      <p>
        <a href="/docs/">{text.value.common.api_explorer}</a> · <a href="/openapi.json">openapi.json</a>
      </p>
    </section>
  );
}
