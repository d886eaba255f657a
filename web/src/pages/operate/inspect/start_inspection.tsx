/** Serial number, order, and Start with the reason if it is blocked; progress while a job is running. */

import { useEffect, useRef } from "preact/hooks";
import type { Job } from "../../../api/client";
import { useApp } from "../../../app";
import { CommandButton } from "../../../components/command_button";
import { TextField } from "../../../components/fields/text_field";
import { href } from "../../../state/browser/route";
import { text } from "../../../text";
import type { Obstacle } from "../readiness";
import { RunProgress } from "../run_progress";
import { SerialField } from "../serial_field";
import { Ended, Remedy } from "../start";
import type { Choice } from "./choice";
import type { InspectionRun, Part } from "./inspection_run";
import { Repeated } from "./repeated";
import { Stages } from "./stages";

interface Properties {
  run: InspectionRun;
  part: Part;
  choice: Choice;
  obstacle: Obstacle | undefined;
  job: Job | undefined;
  held: boolean;
}

export function StartInspection({ run, part, choice, obstacle, job, held }: Properties) {
  const words = text.value.operate;
  const field = useRef<HTMLInputElement>(null);
  const repeated = run.repeated.value;
  const was_asked = useRef(false);
  useEffect(() => {
    // A closed dialog leaves the focus nowhere; the next scan replaces the serial number.
    if (was_asked.current && !repeated) field.current?.select();
    was_asked.current = repeated !== undefined;
  }, [repeated]);
  const blocked = blockedBy({ obstacle, choice, held, serial: part.serial.value });
  const begin = () => {
    if (blocked || run.running) return false;
    void run.command.start();
    return true;
  };
  return (
    <section class="card stack operate-start" aria-label={words.title}>
      <SerialField serial={part.serial} field={field} placeholder={words.serial_scan} onEnter={begin} />
      <TextField
        label={words.order}
        value={part.order.value}
        maxLength={100}
        spellcheck={false}
        onChange={(order) => (part.order.value = order)}
        onKeyDown={(event) => {
          if (event.key === "Enter") field.current?.focus();
        }}
      />
      <Operator />
      {job ? (
        <>
          {job.kind === "inspection" && <Stages job={job} />}
          <RunProgress job={job} />
        </>
      ) : (
        <>
          <CommandButton command={run.command} blocked={blocked} kind="primary operator">
            {words.start_inspection}
          </CommandButton>
          {obstacle && <Remedy obstacle={obstacle} />}
        </>
      )}
      <Ended failed={run.failed} />
      {repeated && <Repeated run={run} earlier={repeated} />}
    </section>
  );
}

/** Whose name is sent with the inspection. */
function Operator() {
  const name = useApp().control.entered_name;
  const words = text.value.operate;
  return (
    <p class="muted operator-sent">
      {name === undefined ? words.operator_unknown : words.operator_sent(name)}{" "}
      <a href={href("settings")}>{name === undefined ? words.operator_enter : words.operator_change}</a>
    </p>
  );
}

interface Situation {
  obstacle: Obstacle | undefined;
  choice: Choice;
  held: boolean;
  serial: string;
}

/** Why Start is blocked. */
function blockedBy({ obstacle, choice, held, serial }: Situation): string | undefined {
  const words = text.value.operate;
  if (obstacle) return words.obstacles[obstacle];
  if (held) return words.held_first;
  if (choice.kind === "none") return words.choose_recipe;
  return serial.trim() === "" ? words.serial_first : undefined;
}
