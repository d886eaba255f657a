/** The help, part of the page, so that it is available offline. */

import { useEffect } from "preact/hooks";
import { useApp } from "../../app";
import { href, PAGES, route } from "../../state/browser/route";
import { digitOf, PAGE_LETTERS } from "../../state/browser/shortcuts";
import { text } from "../../text";
import { LIBRARIES, MIT } from "./licences";
import "./help.css";

const VERDICTS_EXPLAINED = ["ok", "not_ok", "undecided", "invalid", "measured"] as const;

const SECTIONS = ["first", "states", "stop", "shortcuts", "api", "about"] as const;

export default function Help() {
  const words = text.value.help;
  const wanted = route.value.id;
  useEffect(() => {
    const section = wanted ? document.getElementById(`help-${wanted}`) : null;
    section?.scrollIntoView();
    section?.focus({ preventScroll: true });
  }, [wanted]);
  return (
    <div class="help">
      <h1>{words.title}</h1>
      <nav class="row" aria-label={words.contents}>
        {SECTIONS.map((section) => (
          <a key={section} class="button" href={href("help", section)}>
            {words[section]}
          </a>
        ))}
      </nav>
      <section class="card" id="help-first" tabIndex={-1}>
        <h2>{words.first}</h2>
        <ol>
          {words.first_steps.map(([page, does]) => (
            <li key={does}>
              <a href={href(page)}>{text.value.pages[page]}</a>: {does}
            </li>
          ))}
        </ol>
        <p class="muted">{words.simulated}</p>
      </section>
      <States />
      <section class="card" id="help-stop" tabIndex={-1}>
        <h2>{words.stop}</h2>
        <ul>
          {words.stop_rules.map((sentence) => (
            <li key={sentence}>{sentence}</li>
          ))}
        </ul>
      </section>
      <Keys />
      <Api />
      <About />
    </div>
  );
}

function States() {
  const words = text.value;
  return (
    <section class="card" id="help-states" tabIndex={-1}>
      <h2>{words.help.states}</h2>
      <table>
        <thead>
          <tr>
            <th>{words.help.state}</th>
            <th>{words.help.means}</th>
          </tr>
        </thead>
        <tbody>
          {Object.entries(words.help.state_means).map(([state, means]) => (
            <tr key={state}>
              <td>
                <strong>{words.frame.states[state]}</strong>
                <div class="muted mono">{state}</div>
              </td>
              <td>{means}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <h3>{words.help.verdicts}</h3>
      <dl class="facts">
        {VERDICTS_EXPLAINED.map((verdict) => (
          <>
            <dt key={verdict}>{words.outcomes[verdict]}</dt>
            <dd>{words.help.verdict_means[verdict]}</dd>
          </>
        ))}
      </dl>
    </section>
  );
}

function Keys() {
  const words = text.value;
  return (
    <section class="card" id="help-shortcuts" tabIndex={-1}>
      <h2>{words.help.shortcuts}</h2>
      <table class="keys">
        <thead>
          <tr>
            <th>{words.help.keys}</th>
            <th>{words.help.does}</th>
          </tr>
        </thead>
        <tbody>
          {words.help.shortcut_keys.map(([keys, does]) => (
            <tr key={does}>
              <td>
                <kbd>{keys}</kbd>
              </td>
              <td>{does}</td>
            </tr>
          ))}
          {PAGES.map((page) => (
            <tr key={page}>
              <td>
                <kbd>g {PAGE_LETTERS[page]}</kbd> <kbd>Alt + {digitOf(page)}</kbd>
              </td>
              <td>{words.pages[page]}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <p class="muted">
        {words.help.letters_hint} <a href={href("settings")}>{words.pages.settings}</a>
      </p>
    </section>
  );
}

function Api() {
  const words = text.value.help;
  return (
    <section class="card" id="help-api" tabIndex={-1}>
      <h2>{words.api}</h2>
      <p>{words.api_hint}</p>
      <ul>
        <li>
          <a href="/docs/">{text.value.common.api_explorer}</a>
        </li>
        <li>
          <a href="/openapi.json">openapi.json</a>: {words.openapi}
        </li>
        <li>
          <a href={href("jobs")}>{text.value.pages.jobs}</a>: {words.first_job}
        </li>
      </ul>
    </section>
  );
}

function About() {
  const { stream } = useApp();
  const words = text.value.help;
  return (
    <section class="card" id="help-about" tabIndex={-1}>
      <h2>{words.about}</h2>
      <p>
        Sheaf <span class="number version">{stream.server_version.value}</span>, MIT OR Apache-2.0
      </p>
      <p>{words.libraries}</p>
      <ul>
        {LIBRARIES.map(({ name, copyright }) => (
          <li key={name}>
            {name} <span class="muted">{copyright}</span>
          </li>
        ))}
      </ul>
      <details>
        <summary>{words.licence_text}</summary>
        <pre class="licence" lang="en">
          {MIT}
        </pre>
      </details>
    </section>
  );
}
