import type { ComponentChildren } from "preact";
import { text } from "../../text";
import type { Tone } from "./tone";

interface Properties {
  title: string;
  tone: Tone;
  /** The main information of the card. */
  headline: string;
  /** The remedy; shown if the card has a caution or an alarm. */
  advice?: string | undefined;
  children?: ComponentChildren;
}

/** A card that is grey unless there is a caution or an alarm. */
export function HealthCard({ title, tone, headline, advice, children }: Properties) {
  const words = text.value.health;
  return (
    <section class={`card health-card live-data ${tone}`} aria-label={title} data-tone={tone}>
      <h2>{title}</h2>
      <p class="headline">
        {tone !== "calm" && (
          <span class="sign">
            <span aria-hidden="true">{tone === "alarm" ? "✕ " : "! "}</span>
            <span class="visually-hidden">{tone === "alarm" ? words.alarm : words.caution}: </span>
          </span>
        )}
        {headline}
      </p>
      {tone !== "calm" && advice && <p>{advice}</p>}
      {children}
    </section>
  );
}

export function Facts({ of }: { of: readonly (readonly [string, string])[] }) {
  return (
    <dl class="facts">
      {of.map(([name, value]) => (
        <div key={name} class="fact">
          <dt>{name}</dt>
          <dd>{value}</dd>
        </div>
      ))}
    </dl>
  );
}
